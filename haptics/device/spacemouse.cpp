#include "haptics/device/spacemouse.hpp"

#include <poll.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "haptics/device/control.hpp"
#include "haptics/device/shared_library.hpp"
#include "haptics/math/numbers.hpp"
#include "haptics/threads/triple_buffer.hpp"

namespace touchstone {
namespace {

constexpr double kFullDeflection = 350;                       // axis value of libspnav at full deflection
constexpr double kDeadBand = 0.1;                             // share of the full deflection in which the rate is zero
constexpr double kUsualSpeed = 50, kTurnPerSpeed = 1.0 / 50;  // mm/s; rad/mm
// N and mN·m at which the tool stops: the tool is pressed no harder than about this.
constexpr double kFirmForce = 10, kFirmTorque = 100;

/// The events and functions of libspnav, declared here so that the build does not need its header.
union SpnavEvent {
    int type;  ///< 1: motion, 2: button, 3: a cap was added or removed
    struct {
        int type, x, y, z, rx, ry, rz;
        unsigned period;
        int* data;
    } motion;
    struct {
        int type, press, number;
    } button;
    char room[128];  ///< space for other kinds of events
};

struct SpnavLibrary {
    int (*open)();
    int (*close)();
    int (*fd)();
    int (*pollEvent)(SpnavEvent*);
};

SpnavLibrary loadSpnav() {
    const char* named = std::getenv("TOUCHSTONE_LIBSPNAV");
    const SharedLibrary found(named && *named ? std::vector<std::string>{named}
                                              : std::vector<std::string>{"libspnav.so.0", "libspnav.so"});
    if (!found)
        throw std::runtime_error("The SpaceMouse needs libspnav (" + found.errors() +
                                 "): apt install libspnav0 spacenavd");
    SpnavLibrary spnav{};
    std::string missing;
    found.find("spnav_open", spnav.open, missing);
    found.find("spnav_close", spnav.close, missing);
    found.find("spnav_fd", spnav.fd, missing);
    found.find("spnav_poll_event", spnav.pollEvent, missing);
    if (!missing.empty()) throw std::runtime_error(found.name() + " lacks " + missing + ": apt install libspnav0");
    return spnav;
}

/// The daemon sends an event when a value changes, so a cap that is held still is silent: its state holds until the
/// next event.
struct CapState {
    Vec3 move = Vec3::Zero(), turn = Vec3::Zero();  ///< rates, -1 to 1
    std::uint32_t buttons = 0;
};

/// Reads the daemon's events on a separate thread, because that takes system calls. The connection to the daemon is
/// shared.
class CapReader {
  public:
    static std::shared_ptr<CapReader> connect() {
        static std::mutex mutex;
        static std::weak_ptr<CapReader> known;
        const std::lock_guard lock(mutex);
        std::shared_ptr<CapReader> reader = known.lock();
        if (!reader || reader->lost()) known = reader = std::make_shared<CapReader>();
        return reader;
    }

    CapReader() : spnav_(loadSpnav()) {
        if (spnav_.open() < 0)
            throw std::runtime_error(
                "The SpaceMouse's daemon does not answer: start it with 'sudo systemctl start spacenavd'");
        thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
    }
    ~CapReader() {
        thread_ = {};
        if (!lost()) spnav_.close();
    }

    /// Whether the daemon is gone. The connection is then closed, so that another one can be made.
    bool lost() const { return lost_.load(std::memory_order_acquire); }
    const CapState& newest() noexcept {
        states_.update();
        return states_.get();
    }

  private:
    void run(const std::stop_token& stop) {
        CapState state;
        pollfd wait{.fd = spnav_.fd(), .events = POLLIN, .revents = 0};
        while (!stop.stop_requested() && !lost()) {
            if (poll(&wait, 1, 50) <= 0) continue;
            SpnavEvent event{};
            while (spnav_.pollEvent(&event) != 0) {
                const auto& m = event.motion;
                const auto& b = event.button;
                if (event.type == 1) {  // libspnav's z points away from the user
                    state.move = {spaceMouseRate(m.x), spaceMouseRate(m.y), -spaceMouseRate(m.z)};
                    state.turn = {spaceMouseRate(m.rx), spaceMouseRate(m.ry), -spaceMouseRate(m.rz)};
                } else if (event.type == 2 && b.number >= 0 && b.number < 32) {
                    const std::uint32_t bit = 1u << b.number;
                    state.buttons = b.press ? state.buttons | bit : state.buttons & ~bit;
                } else if (event.type == 3) {  // a cap that was unplugged while it was held sends no zero
                    state = {};
                }
                states_.write(state);
            }
            if (wait.revents & (POLLHUP | POLLERR | POLLNVAL)) {
                spnav_.close();
                lost_.store(true, std::memory_order_release);
            }
        }
    }

    const SpnavLibrary spnav_;
    TripleBuffer<CapState> states_;
    std::atomic<bool> lost_ = false;
    std::jthread thread_;
};

class SpaceMouseControl final : public DeviceControl {
  public:
    explicit SpaceMouseControl(std::shared_ptr<CapReader> reader) : reader_(std::move(reader)) {}
    DeviceStatus status() const override {
        if (reader_->lost())
            return {.state = DeviceStatus::State::Lost,
                    .text = "The SpaceMouse's daemon is gone: start spacenavd and choose the device again"};
        return {.text = "The SpaceMouse runs"};
    }
    Maps maps() const override { return Maps::Axes; }
    Workspace workspace() const override { return newest_; }
    void setWorkspace(const Workspace& workspace) override {
        newest_ = workspace;
        axes_.write(workspace.q_WD);
    }
    TripleBuffer<Quat>& axes() { return axes_; }

  private:
    const std::shared_ptr<CapReader> reader_;
    Workspace newest_;  // used only by the window's thread
    TripleBuffer<Quat> axes_{Quat::Identity()};
};

class SpaceMouseDevice final : public Device {
  public:
    SpaceMouseDevice(std::shared_ptr<CapReader> reader, const Pose& X_WT_start, double speed)
        : reader_(std::move(reader)),
          control_(std::make_shared<SpaceMouseControl>(reader_)),
          X_WT_start_(X_WT_start),
          X_WT_(X_WT_start),
          speed_(speed) {}

    DeviceLimits limits() const noexcept override { return {.motors = false}; }
    DeviceReading read(double t, double dt) noexcept override {
        if (t <= 0) X_WT_ = X_WT_start_;
        if (reader_->lost()) return {.X_WT_device = X_WT_, .valid = false, .fault = true};
        const CapState& cap = reader_->newest();
        control_->axes().update();
        const Quat& q_WD = control_->axes().get();
        if (t > 0) {
            X_WT_.p += 1e-3 * dt * speed_ * heldBack(q_WD * cap.move, wrench_.force, kFirmForce);
            const Vec3 turn =
                1e-3 * dt * speed_ * kTurnPerSpeed * heldBack(q_WD * cap.turn, wrench_.torque, kFirmTorque);
            X_WT_.q = (expRotation(turn) * X_WT_.q).normalized();
        }
        return {.X_WT_device = X_WT_, .buttons = cap.buttons};
    }
    void write(const Wrench& wrench) noexcept override { wrench_ = wrench; }
    void engage(const Pose& X_WT) noexcept override { X_WT_ = X_WT; }
    std::shared_ptr<DeviceControl> control() const override { return control_; }

  private:
    static Vec3 heldBack(const Vec3& rate, const Vec3& load, double firm) noexcept {
        const double length = rate.norm();
        if (!(length > 0)) return rate;
        return rate * std::clamp(1 + load.dot(rate) / (length * firm), 0.0, 1.0);
    }

    const std::shared_ptr<CapReader> reader_;
    const std::shared_ptr<SpaceMouseControl> control_;
    const Pose X_WT_start_;
    Pose X_WT_;
    const double speed_;  // mm/s
    Wrench wrench_;
};

}  // namespace

double spaceMouseRate(int value) {
    const double deflection = std::min(std::abs(value) / kFullDeflection, 1.0);
    const double rate = std::max(0.0, (deflection - kDeadBand) / (1 - kDeadBand));
    return value < 0 ? -rate : rate;
}

std::unique_ptr<Device> makeSpaceMouse(const DeviceContext& context) {
    double speed = kUsualSpeed;
    if (const std::string& text = context.file; !text.empty()) {
        const auto read = readNumber(text, 0.1, 1000);
        if (!read)
            throw std::runtime_error("spacemouse: '" + text +
                                     "' is not a speed: write spacemouse:SPEED, 0.1 to 1000 mm/s");
        speed = *read;
    }
    return std::make_unique<SpaceMouseDevice>(CapReader::connect(), context.X_WT_start, speed);
}

DeviceCheck examineSpaceMouse() {
    try {
        CapReader::connect();
        return {true, "libspnav and its daemon answer"};
    } catch (const std::exception& e) {
        return {false, e.what()};
    }
}

}  // namespace touchstone
