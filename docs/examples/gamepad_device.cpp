// Your own device: the sticks of a gamepad move the tool. It works in the scene's frame and gives no force.
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "haptics/device/device.hpp"
#include "haptics/device/device_table.hpp"

namespace touchstone {
namespace {

class GamepadDevice final : public Device {
  public:
    GamepadDevice(const std::string& file, const Pose& X_WT_start)
        : file_(open(file.c_str(), O_RDONLY | O_NONBLOCK)), X_WT_start_(X_WT_start), X_WT_(X_WT_start) {
        if (file_ < 0) throw std::runtime_error("gamepad: cannot read '" + file + "': connect the gamepad");
    }
    ~GamepadDevice() override { close(file_); }

    // In the scene's frame: mm and a unit quaternion. Neither call may wait, allocate, lock or throw.
    DeviceReading read(double t, double dt) noexcept override {
        if (t <= 0) X_WT_ = X_WT_start_;
        struct Event {  // of the kernel's joystick interface
            std::uint32_t time;
            std::int16_t value;
            std::uint8_t type, number;  // type 1: button, 2: axis
        } event;
        while (::read(file_, &event, sizeof event) == sizeof event) {
            if ((event.type & 2) && event.number < axes_.size()) axes_[event.number] = event.value / 32767.0;
            if ((event.type & 1) && event.number < 32)
                buttons_ = event.value ? buttons_ | 1u << event.number : buttons_ & ~(1u << event.number);
        }
        X_WT_.p += kSpeed * dt * Vec3(axes_[0], -axes_[4], axes_[1]);  // left stick: right and toward you; right: up
        return {.X_WT_device = X_WT_, .buttons = buttons_};
    }
    void write(const Wrench&) noexcept override {}                     // N and mN·m that a hand would feel
    void engage(const Pose& X_WT) noexcept override { X_WT_ = X_WT; }  // go on from where the tool is
    DeviceLimits limits() const noexcept override { return {.motors = false}; }

  private:
    static constexpr double kSpeed = 0.05;  // mm/ms
    const int file_;
    const Pose X_WT_start_;
    Pose X_WT_;
    std::array<double, 8> axes_{};  // -1 to 1
    std::uint32_t buttons_ = 0;
};

}  // namespace

// Its row in haptics/device/device_table.cpp:
// DeviceInfo{"gamepad", "a gamepad, as gamepad:FILE", Mover::Person, makeGamepad}
std::unique_ptr<Device> makeGamepad(const DeviceContext& context) {
    return std::make_unique<GamepadDevice>(context.file.empty() ? "/dev/input/js0" : context.file, context.X_WT_start);
}

}  // namespace touchstone
