#pragma once
// The mouse as a device: the window says where the hand wants the tool, a simulated hand goes there.
#include "haptics/device/device.hpp"
#include "haptics/device/hand.hpp"
#include "haptics/threads/triple_buffer.hpp"

namespace touchstone {

/// Where the window wants the hand; from the window's thread to the haptic thread, newest wins, wait-free. One writer
/// (the window) and one reader (the device that holds it).
class MouseTarget {
  public:
    struct State {
        bool grabbed = false;  ///< false: the hand stays at the last target it was given
        Pose X_WT;             ///< wanted pose of the tool node, scene frame
        double strength = 1;   ///< of the hand's pull, kWeakest to kStrongest
    };
    static constexpr double kWeakest = 0.1, kStrongest = 4;

    /// Window only. An invalid pose (Pose::isValid) is ignored: a cursor may point past the horizon.
    void grab(const Pose& X_WT, double strength = 1) { states_.write({true, X_WT, strength}); }
    /// Window only: the hand holds on where it was, so that the force stays while a slider is dragged.
    void release(double strength = 1) { states_.write({false, {}, strength}); }

    /// Device only: takes the newest state; false if nothing came since the last call.
    bool update() { return states_.update(); }
    const State& get() const { return states_.get(); }

  private:
    TripleBuffer<State> states_;
};

/// A hand on a mouse. Time 0 puts hand and target back to the start.
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

/// Row of the device table. Throws std::runtime_error without a window's target.
std::unique_ptr<Device> makeMouse(const DeviceContext& context);

}  // namespace touchstone
