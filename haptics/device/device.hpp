#pragma once
// The device interface. A device moves the tool: it gives a pose and takes a wrench.
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>

#include "haptics/math/rigid.hpp"

namespace touchstone {

/// Limits that the safety stage enforces. The defaults are those of a Phantom Premium 3.0 / 6DOF (docs/devices.md).
struct DeviceLimits {
    double peakForce = 22;         ///< N
    double peakTorque = 170;       ///< mN·m on each axis
    double continuousForce = 3;    ///< N, which the motors bear for an unlimited time
    double continuousTorque = 48;  ///< mN·m on each axis
    double slewForce = 3;          ///< N/ms, maximum rate at which the force may grow or turn
    double slewTorque = 40;        ///< mN·m/ms
    bool torque = true;            ///< false: force only; the safety stage drops every torque, and judges none
    /// False: the wrench moves nothing, so nothing can heat up, vibrate or start unexpectedly (docs/safety.md).
    bool motors = true;
    /// Largest gains that the device is made for, as the hand feels them: N/mm and mN·m/rad.
    double nominalStiffness = std::numeric_limits<double>::infinity();
    double nominalTorsion = std::numeric_limits<double>::infinity();
};

/// Properties that decide whether a stiffness can be rendered passively. A spring of stiffness k that is sampled and
/// held with the period T is stable if damping >= k T (0.5 + delay) (Colgate; the delay term by experiment).
struct DeviceDynamics {
    double damping = 0;  ///< sum of the device's and the hand's, N·s/m
    double delay = 0;    ///< from reading the pose until the wrench acts on the hand, ticks
};
/// Least damping for a passive rendering, N·s/m, for a stiffness in N/mm, a rate in Hz and a delay in ticks. For a
/// stiffness in mN·m/rad the result is in mN·m·ms/rad.
inline double leastDamping(double stiffness, double rate, double delay) {
    return stiffness * 1000 / rate * (0.5 + delay);
}

struct DeviceReading {
    Pose X_WT_device;           ///< desired pose of the tool node, scene frame; bad input if it is not isValid()
    bool valid = true;          ///< false: no fresh pose; the tick holds the tool and the force is zero
    bool finished = false;      ///< a recorded motion has ended (its last pose is held)
    bool fault = false;         ///< the device has failed: zero force until the user engages it again
    std::uint32_t buttons = 0;  ///< pressed buttons as bits; the first button is bit 0
};

class DeviceControl;

/// read() and write() are called only by the haptic thread and are real time: no allocation, lock, log or throw.
class Device {
  public:
    virtual ~Device() = default;
    /// Reads the pose at `t` ms since the start; consecutive calls are `dt` ms apart.
    virtual DeviceReading read(double t, double dt) noexcept = 0;
    /// Receives the wrench on the hand about the tool node's origin in world axes, after the safety stage.
    virtual void write(const Wrench& wrench_o) noexcept = 0;
    /// Receives the tool pose of the same tick, which a person sees. Called after write(), also real time.
    virtual void show(const Pose& /*X_WT*/) noexcept {}
    /// Sets the force to zero immediately: the emergency stop of a process that ends. May be called from any thread and
    /// from a signal handler, while read() or write() is in progress. Async-signal-safe. Best effort, within the
    /// device's abilities.
    virtual void releaseForces() noexcept {}
    /// From the next read() on, the hand's present pose corresponds to the tool pose X_WT. A recorded motion ignores
    /// this.
    virtual void engage(const Pose& /*X_WT*/) noexcept {}
    virtual DeviceLimits limits() const noexcept { return {}; }
    /// Duration of a motion whose end does not depend on the contacts, ms; nothing if it is unknown.
    virtual std::optional<double> duration() const noexcept { return {}; }
    /// Nothing if the properties are unknown or the wrench moves nothing.
    virtual std::optional<DeviceDynamics> dynamics() const noexcept { return {}; }
    /// A device whose own scheduler drives the ticks calls `tick` on its thread at `rate` Hz until `tick` returns
    /// false. Then this returns true, and `tick` is not called any more. It returns false immediately if the device
    /// does not drive, and later if the scheduler stalls: the caller then paces the ticks.
    virtual bool drive(double /*rate*/, const std::function<bool()>& /*tick*/) noexcept { return false; }
    /// The part of the device that the window may read and change. Called once, before the first tick. Null if there is
    /// none.
    virtual std::shared_ptr<DeviceControl> control() const { return nullptr; }
};

}  // namespace touchstone
