#pragma once
// The mouse as a device: the window sets a target for the tool, and a simulated hand moves there.
#include "haptics/device/device.hpp"
#include "haptics/device/device_table.hpp"
#include "haptics/hands/hand.hpp"
#include "haptics/threads/triple_buffer.hpp"

namespace touchstone {

/// The hand's target, passed from the window's thread to the haptic thread. Newest wins; wait-free. One writer (the
/// window) and one reader (the device that owns it).
class MouseTarget {
  public:
    struct State {
        bool grabbed = false;  ///< false: the hand keeps its last target
        Pose X_WT;             ///< desired tool pose, scene frame
        double strength = 1;   ///< strength of the hand's pull, kWeakest to kStrongest
    };
    static constexpr double kWeakest = 0.1, kStrongest = 4;

    /// Window only. An invalid pose (Pose::isValid) is ignored: a cursor may point past the horizon.
    void grab(const Pose& X_WT, double strength = 1) { states_.write({true, X_WT, strength}); }
    /// Window only. The hand keeps its last target, so that the force stays while a slider is dragged.
    void release(double strength = 1) { states_.write({false, {}, strength}); }

    /// Device only. Takes the newest state. Returns false if there is none since the last call.
    bool update() { return states_.update(); }
    const State& get() const { return states_.get(); }

  private:
    TripleBuffer<State> states_;
};

/// A simulated hand that follows the mouse. A reading at time 0 resets hand and target to the start.
class MouseDevice final : public Device {
  public:
    MouseDevice(std::shared_ptr<MouseTarget> target, const Pose& X_WT_start, const HandParameters& hand = {});
    DeviceReading read(double t, double dt) noexcept override;
    void write(const Wrench& wrench_o) noexcept override { wrench_o_ = wrench_o; }
    void engage(const Pose& X_WT) noexcept override;
    DeviceLimits limits() const noexcept override { return {.motors = false}; }
    std::optional<DeviceDynamics> dynamics() const noexcept override { return {{hand_.parameters().damping, 0}}; }

  private:
    std::shared_ptr<MouseTarget> source_;
    Pose X_WT_start_;
    Pose X_WT_target_;
    HandParameters parameters_;
    double strength_ = 1;
    Hand hand_;
    Wrench wrench_o_;
};

/// Row of the device table. Throws std::runtime_error if there is no window that sets a target.
std::unique_ptr<Device> makeMouse(const DeviceContext& context);

}  // namespace touchstone
