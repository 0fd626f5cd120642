#include "haptics/sandbox/devices/web_sockets.hpp"

#include <libwebsockets.h>
#include <poll.h>

#include <stdexcept>

namespace touchstone::sandbox {
namespace {

constexpr const char* kHost = "127.0.0.1";
constexpr const char* kProtocol = "touchstone";  // our own name for the callback; it is not sent
constexpr lws_usec_t kServeUs = 10'000;          // longest time in serve()
constexpr unsigned kConnectSeconds = 3;

}  // namespace

WebSockets::WebSockets(WebSocketListener& listener) : listener_(listener) {
    lws_set_log_level(0, nullptr);
    static const lws_protocols protocols[]{{kProtocol,
                                            [](lws* connection, lws_callback_reasons reason, void*, void* in,
                                               std::size_t size) { return callback(connection, reason, in, size); },
                                            0, 0, 0, nullptr, 0},
                                           {nullptr, nullptr, 0, 0, 0, nullptr, 0}};
    lws_context_creation_info info{};
    info.port = CONTEXT_PORT_NO_LISTEN;
    info.protocols = protocols;
    info.user = this;
    info.gid = static_cast<gid_t>(-1);
    info.uid = static_cast<uid_t>(-1);
    info.timeout_secs = kConnectSeconds;
    info.fd_limit_per_thread = 16;
    context_ = lws_create_context(&info);
    if (!context_) throw std::runtime_error("libwebsockets cannot start: the system refuses sockets or memory");
}

WebSockets::~WebSockets() {
    for (Channel& channel : channels_) channel.socket = -1;
    lws_context* const context = context_;
    context_ = nullptr;  // the listener hears nothing of the end
    lws_context_destroy(context);
}

void WebSockets::connect(int channel, int port) {
    lws_client_connect_info info{};
    info.context = context_;
    info.address = info.host = info.origin = kHost;
    info.port = port;
    info.path = "/";
    info.local_protocol_name = kProtocol;
    info.opaque_user_data = &channels_[static_cast<std::size_t>(channel)];
    info.pwsi = &channels_[static_cast<std::size_t>(channel)].connection;
    lws_client_connect_via_info(&info);
}

void WebSockets::serve() {
    lws_sorted_usec_list_t timer{};
    lws_sul_schedule(
        context_, 0, &timer, [](lws_sorted_usec_list_t*) {}, kServeUs);
    lws_service(context_, 0);
    lws_sul_schedule(context_, 0, &timer, nullptr, LWS_SET_TIMER_USEC_CANCEL);
}

void WebSockets::send(int channel, std::string_view message) {
    Channel& to = channels_[static_cast<std::size_t>(channel)];
    if (to.socket < 0) return;
    to.out.assign(LWS_PRE, '\0');
    to.out += message;
    lws_callback_on_writable(to.connection);
}

bool WebSockets::pending(int channel) const {
    pollfd wait{.fd = socket(channel), .events = POLLIN, .revents = 0};
    return wait.fd >= 0 && poll(&wait, 1, 0) > 0;
}

void WebSockets::end(int channel, const std::string& why) {
    Channel& its = channels_[static_cast<std::size_t>(channel)];
    its.socket = -1;
    its.connection = nullptr;
    if (context_) listener_.closed(channel, its.ended.empty() ? why : its.ended);
    its.ended.clear();
}

int WebSockets::callback(lws* connection, int reason, void* in, std::size_t size) {
    auto* const its = static_cast<Channel*>(lws_get_opaque_user_data(connection));
    if (!its) return 0;
    auto& self = *static_cast<WebSockets*>(lws_context_user(lws_get_context(connection)));
    const int channel = static_cast<int>(its - self.channels_.data());
    switch (reason) {
        case LWS_CALLBACK_CLIENT_ESTABLISHED:
            its->in.clear();
            its->socket = lws_get_socket_fd(connection);
            self.listener_.opened(channel);
            break;
        case LWS_CALLBACK_CLIENT_RECEIVE:
            if (lws_is_first_fragment(connection)) its->in.clear();
            if (its->in.size() + size > kLongestMessage) {
                its->ended = kTooLong;
                return -1;
            }
            its->in.append(static_cast<const char*>(in), size);
            if (lws_is_final_fragment(connection)) self.listener_.received(channel, its->in);
            break;
        case LWS_CALLBACK_CLIENT_WRITEABLE: {
            if (its->out.size() <= LWS_PRE) break;
            const std::size_t length = its->out.size() - LWS_PRE;
            auto* const text = reinterpret_cast<unsigned char*>(its->out.data()) + LWS_PRE;
            const int sent = lws_write(connection, text, length, LWS_WRITE_TEXT);
            its->out.clear();
            if (sent < static_cast<int>(length)) return -1;
            break;
        }
        case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
            self.end(channel, in ? std::string(static_cast<const char*>(in)) : "no connection");
            break;
        case LWS_CALLBACK_CLIENT_CLOSED:
            self.end(channel, "the other side ended the connection");
            break;
        default:
            break;
    }
    return 0;
}

}  // namespace touchstone::sandbox
