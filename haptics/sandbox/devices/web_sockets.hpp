#pragma once
// Connections to WebSockets of this machine, through libwebsockets.
#include <array>
#include <atomic>
#include <string>
#include <string_view>

struct lws;
struct lws_context;

namespace touchstone::sandbox {

/// What happens on the connections; called by the thread that serves them.
class WebSocketListener {
  public:
    virtual void opened(int channel) = 0;
    virtual void received(int channel, const std::string& message) = 0;
    /// The connection was refused or has ended, for the reason `why`.
    virtual void closed(int channel, const std::string& why) = 0;

  protected:
    ~WebSocketListener() = default;
};

/// Two connections to 127.0.0.1. Everything but socket() belongs to the thread that calls serve().
class WebSockets {
  public:
    static constexpr int kChannels = 2;
    /// Longest message that is accepted, bytes: a longer one ends the connection. An inventory has some kilobytes.
    static constexpr std::size_t kLongestMessage = 1 << 20;
    static constexpr std::string_view kTooLong = "a message of more than 1 MiB";  ///< then the reason

    /// Throws std::runtime_error if the system gives no resources.
    explicit WebSockets(WebSocketListener& listener);
    ~WebSockets();
    WebSockets(const WebSockets&) = delete;
    WebSockets& operator=(const WebSockets&) = delete;

    void connect(int channel, int port);
    /// Handles what has arrived; returns after at most 10 ms.
    void serve();
    /// Sends a text message as soon as the socket takes it, in place of one that still waits.
    void send(int channel, std::string_view message);
    /// Whether data of this channel has arrived that serve() has not yet handled.
    bool pending(int channel) const;
    /// The system's number of the socket; -1 if the channel is not open. For any thread and signal handlers.
    int socket(int channel) const noexcept { return channels_[static_cast<std::size_t>(channel)].socket.load(); }

  private:
    struct Channel {
        lws* connection = nullptr;
        std::string in, out;  // out begins with the room that the library needs
        std::atomic<int> socket = -1;
        std::string ended;  // why we end the connection
    };
    static int callback(lws* connection, int reason, void* in, std::size_t size);
    void end(int channel, const std::string& why);

    WebSocketListener& listener_;
    std::array<Channel, kChannels> channels_;
    lws_context* context_ = nullptr;
};

}  // namespace touchstone::sandbox
