#include "tests/support/fake_inverse/fake_inverse.hpp"

#include <libwebsockets.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <deque>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <thread>

namespace touchstone::test {
namespace {

using nlohmann::json;

// A hand of 0.1 kg that reaches its target within a few hundredths of a second, in mm, N, ms; a tick is 1 ms.
constexpr double kMass = 100, kSpring = 0.5, kDamping = 14;
constexpr int kHeldMs = 50;          // a force that is not renewed ends; the real time is not known
constexpr std::size_t kPart = 4096;  // of a message in fragments

json vec(double x, double y, double z) { return {{"x", x}, {"y", y}, {"z", z}}; }

}  // namespace

struct FakeInverse::Service {
    lws_context* context = nullptr;
    int port = 0, eventsPort = 0;
    std::thread thread;
    std::atomic<bool> stop = false;

    mutable std::mutex mutex;  // guards the rest
    std::string faults;
    State state;
    Vec3 velocity = Vec3::Zero(), handP = Vec3::Zero();
    Quat q = Quat::Identity();
    int pressed = 0;
    std::deque<std::string> events;
    bool endEvents = false;
    using Clock = std::chrono::steady_clock;
    Clock::time_point moved = Clock::now(), commanded{};

    // Used by the thread alone.
    std::map<lws*, std::deque<std::string>> simulations, listeners;
    std::map<lws*, std::string> received;
    std::map<lws*, std::size_t> sent;

    bool has(const std::string& fault) const {
        return ("," + faults + ",").find("," + fault + ",") != std::string::npos;
    }

    void move() {
        const auto now = Clock::now();
        for (int i = 0; i < 1000 && moved + std::chrono::milliseconds(1) <= now; ++i) {
            moved += std::chrono::milliseconds(1);
            if (moved > commanded + std::chrono::milliseconds(kHeldMs)) state.force.setZero();
            velocity += (kSpring * (handP - state.position) - kDamping * velocity + state.force) / kMass;
            state.position += velocity;
        }
        if (now > commanded + std::chrono::milliseconds(kHeldMs)) state.force.setZero();
    }

    json device(bool inventory) const {
        const Vec3 p = 1e-3 * state.position;  // here x right, y forward, z up
        json its{{"device_id", "049D"},
                 {"state",
                  {{"cursor_position", vec(p.x(), -p.z(), p.y())},
                   {"cursor_velocity", vec(0, 0, 0)},
                   {"angular_position", {{"a0", -30.9}, {"a1", 53.8}, {"a2", -6.6}}},
                   {"control_mode", "cartesian"}}},
                 {"status",
                  {{"calibrated", !has("uncalibrated")},
                   {"in_use", false},
                   {"power_supply", !has("unpowered")},
                   {"ready", true},
                   {"started", true}}}};
        if (inventory) {
            its["config"] = {{"type", "inverse3"}, {"handedness", "right"}, {"extended_firmware_version", "F-1"}};
            if (!has("old")) its["config"]["basis"] = {{"permutation", has("other-basis") ? "XZY" : "XYZ"}};
        }
        json& at = its["state"]["cursor_position"];
        if (has("null")) at["y"] = nullptr;
        if (has("far")) at["x"] = 1e6;
        if (has("missing")) its["state"].erase("cursor_position");
        return its;
    }

    json all(bool inventory) const {
        json message{{"inverse3", json::array()}, {"verse_grip", json::array()}};
        if (!has("unplugged") && !has("no-device")) message["inverse3"].push_back(device(inventory));
        if (!has("grip-gone") && !has("no-grip")) {
            // The axis of the turn is that of the body in the device's axes; here x right, y forward, z up.
            message["wireless_verse_grip"] = json::array();
            message["wireless_verse_grip"].push_back(
                {{"device_id", "VG01"},
                 {"state",
                  {{"orientation", {{"w", q.w()}, {"x", q.x()}, {"y", -q.z()}, {"z", q.y()}}},
                   {"hall", 0},
                   {"buttons", {{"a", (pressed & 1) != 0}, {"b", (pressed & 2) != 0}, {"c", (pressed & 4) != 0}}}}},
                 {"status", {{"connected", true}, {"awake", !has("grip-asleep")}, {"ready", true}}}});
        }
        if (inventory && !has("old")) message["session_id"] = 7;
        if (has("large")) message["extra"] = std::string(200 * 1024, 'x');
        if (has("huge")) message["extra"] = std::string(2 * 1024 * 1024, 'x');
        return message;
    }

    std::string reply() const {
        if (has("malformed")) return R"({"inverse3": [{"device_id": "049D", )";
        std::string text = all(false).dump();
        if (has("nan") || has("infinity")) {
            const std::size_t at = text.find("\"x\":", text.find("cursor_position")) + 4;
            text.replace(at, text.find(',', at) - at, has("nan") ? "NaN" : "1e999");
        }
        return text;
    }

    void take(const std::string& text) {
        const json message = json::parse(text, nullptr, false);
        bool understood = false;
        if (message.is_object() && message.contains("inverse3"))
            for (const json& entry : message["inverse3"]) {
                const json& command = entry.value("commands", json::object());
                if (entry.value("device_id", "") != "049D" || !command.contains("set_cursor_force")) continue;
                const json& force = command["set_cursor_force"];
                const char* key = has("old") ? "values" : "vector";
                if (!force.contains(key) || !force[key].contains("x")) continue;
                const json& f = force[key];
                move();
                state.force = {f["x"].get<double>(), f["z"].get<double>(), -f["y"].get<double>()};
                state.peakForce = std::max(state.peakForce, state.force.norm());
                state.lastWasZero = state.force.isZero(0);
                ++state.commands;
                commanded = Clock::now();
                understood = true;
            }
        state.misuses += !understood;
    }

    /// Writes the next part of the oldest message.
    int write(lws* connection, std::deque<std::string>& queue) {
        if (queue.empty()) return 0;
        const std::string& text = queue.front();
        std::size_t& at = sent[connection];
        const std::size_t part = text.size() > 100'000 ? std::min(kPart, text.size() - at) : text.size();
        const bool first = at == 0, last = at + part == text.size();
        std::string buffer(LWS_PRE, '\0');
        buffer += text.substr(at, part);
        const int how = (first ? LWS_WRITE_TEXT : LWS_WRITE_CONTINUATION) | (last ? 0 : LWS_WRITE_NO_FIN);
        auto* const begin = reinterpret_cast<unsigned char*>(buffer.data()) + LWS_PRE;
        if (lws_write(connection, begin, part, static_cast<lws_write_protocol>(how)) < 0) return -1;
        at += part;
        if (last) {
            queue.pop_front();
            at = 0;
        }
        if (!queue.empty()) lws_callback_on_writable(connection);
        return 0;
    }

    int simulation(lws* connection, lws_callback_reasons reason, void* in, std::size_t size) {
        const std::lock_guard lock(mutex);
        switch (reason) {
            case LWS_CALLBACK_ESTABLISHED:
                ++state.connections;
                move();
                if (!has("nothing"))
                    simulations[connection].push_back(has("hello")     ? R"({"hello": "world"})"
                                                      : has("garbage") ? "\x7F\x45LF"
                                                                       : all(true).dump());
                lws_callback_on_writable(connection);
                break;
            case LWS_CALLBACK_RECEIVE: {
                if (has("disconnect")) return -1;
                std::string& text = received[connection];
                text.append(static_cast<const char*>(in), size);
                if (!lws_is_final_fragment(connection)) break;
                take(text);
                text.clear();
                if (has("slow")) usleep(6000);
                move();
                if (!has("silent")) simulations[connection].push_back(reply());
                lws_callback_on_writable(connection);
                break;
            }
            case LWS_CALLBACK_SERVER_WRITEABLE:
                return write(connection, simulations[connection]);
            case LWS_CALLBACK_CLOSED:
                --state.connections;
                state.force.setZero();  // its session has ended
                simulations.erase(connection);
                received.erase(connection);
                sent.erase(connection);
                break;
            default:
                break;
        }
        return 0;
    }

    int event(lws* connection, lws_callback_reasons reason) {
        const std::lock_guard lock(mutex);
        if (reason == LWS_CALLBACK_ESTABLISHED) listeners[connection];
        if (reason == LWS_CALLBACK_SERVER_WRITEABLE) {
            if (endEvents) return -1;
            return write(connection, listeners[connection]);
        }
        if (reason == LWS_CALLBACK_CLOSED) {
            listeners.erase(connection);
            sent.erase(connection);
        }
        return 0;
    }

    void distributeEvents() {
        const std::lock_guard lock(mutex);
        for (auto& [connection, queue] : listeners) {
            queue.insert(queue.end(), events.begin(), events.end());
            if (!queue.empty() || endEvents) lws_callback_on_writable(connection);
        }
        events.clear();
    }

    void run() {
        while (!stop) {
            lws_sorted_usec_list_t timer{};
            lws_sul_schedule(
                context, 0, &timer, [](lws_sorted_usec_list_t*) {}, 5000);
            lws_service(context, 0);
            lws_sul_schedule(context, 0, &timer, nullptr, LWS_SET_TIMER_USEC_CANCEL);
            distributeEvents();
        }
    }
};

FakeInverse::FakeInverse(const std::string& faults, int port, int eventsPort) : service_(new Service) {
    Service& s = *service_;
    s.faults = faults;
    lws_set_log_level(0, nullptr);
    lws_context_creation_info info{};
    info.options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS;
    info.gid = static_cast<gid_t>(-1);
    info.uid = static_cast<uid_t>(-1);
    info.user = &s;
    info.fd_limit_per_thread = 32;
    s.context = lws_create_context(&info);
    if (!s.context) throw std::runtime_error("fake_inverse: libwebsockets does not start");
    static const lws_protocols simulation[]{
        {"simulation",
         [](lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t size) {
             return static_cast<Service*>(lws_context_user(lws_get_context(wsi)))->simulation(wsi, reason, in, size);
         },
         0, 0, 0, nullptr, 0},
        {nullptr, nullptr, 0, 0, 0, nullptr, 0}};
    static const lws_protocols events[]{
        {"events",
         [](lws* wsi, lws_callback_reasons reason, void*, void*, std::size_t) {
             return static_cast<Service*>(lws_context_user(lws_get_context(wsi)))->event(wsi, reason);
         },
         0, 0, 0, nullptr, 0},
        {nullptr, nullptr, 0, 0, 0, nullptr, 0}};
    info.iface = "127.0.0.1";
    const auto listen = [&](const lws_protocols* protocols, int at, const char* name) {
        info.protocols = protocols;
        info.port = at;
        info.vhost_name = name;
        lws_vhost* const host = lws_create_vhost(s.context, &info);
        if (!host) throw std::runtime_error("fake_inverse: port " + std::to_string(at) + " is taken");
        return lws_get_vhost_listen_port(host);
    };
    s.port = listen(simulation, port, "simulation");
    s.eventsPort = listen(events, eventsPort, "events");
    s.thread = std::thread([&s] { s.run(); });
}

FakeInverse::~FakeInverse() {
    service_->stop = true;
    lws_cancel_service(service_->context);
    service_->thread.join();
    lws_context_destroy(service_->context);
}

int FakeInverse::port() const { return service_->port; }
int FakeInverse::eventsPort() const { return service_->eventsPort; }
std::string FakeInverse::options() const {
    return "port=" + std::to_string(port()) + ",events=" + std::to_string(eventsPort());
}

FakeInverse::State FakeInverse::state() const {
    const std::lock_guard lock(service_->mutex);
    service_->move();
    return service_->state;
}

void FakeInverse::hand(const Vec3& p, const Vec3& turn) {
    const std::lock_guard lock(service_->mutex);
    service_->move();
    service_->handP = p;
    service_->q = expRotation(turn);
}

void FakeInverse::buttons(int pressed) {
    const std::lock_guard lock(service_->mutex);
    service_->pressed = pressed;
}

void FakeInverse::fault(const std::string& faults) {
    const std::lock_guard lock(service_->mutex);
    service_->faults = faults;
}

void FakeInverse::event(const std::string& name, const std::string& level, const std::string& safetyType,
                        const std::string& device) {
    json data{{"device_family", "inverse"}, {"device_id", device}};
    if (!safetyType.empty()) data["safety_type"] = safetyType;
    const json event{{"name", name}, {"category", "device"}, {"level", level}, {"data", data}, {"message", "as asked"}};
    const std::lock_guard lock(service_->mutex);
    service_->events.push_back(event.dump());
}

void FakeInverse::endEvents() {
    const std::lock_guard lock(service_->mutex);
    service_->endEvents = true;
}

}  // namespace touchstone::test
