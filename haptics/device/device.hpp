#pragma once
// What holds the tool: a device gives a pose and takes a wrench.
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "haptics/math/rigid.hpp"

namespace touchstone {

/// What the safety stage may let through. Defaults: Phantom Premium 3.0 / 6DOF (docs/devices).
struct DeviceLimits {
    double peakForce = 22;         ///< N
    double peakTorque = 170;       ///< mN·m on each axis
    double continuousForce = 3;    ///< N, what the motors bear for any time
    double continuousTorque = 48;  ///< mN·m on each axis
    double slewForce = 3;          ///< N/ms, how fast the force may grow or turn
    double slewTorque = 40;        ///< mN·m/ms
    /// False: the wrench moves nothing, so nothing can heat, shake or start unasked (docs/safety).
    bool motors = true;
    /// Greatest gains that it is made for, as the hand feels them: N/mm and mN·m/rad.
    double nominalStiffness = std::numeric_limits<double>::infinity();
    double nominalTorsion = std::numeric_limits<double>::infinity();
};

/// What decides whether a stiffness can be rendered passively: a spring of k that is sampled every T and held is stable
/// where damping >= k T (0.5 + delay) (Colgate; with delay by experiment).
struct DeviceDynamics {
    double damping = 0;  ///< of device and hand together, N·s/m
    double delay = 0;    ///< from reading the pose to the wrench on the hand, ticks
};
/// N·s/m, of N/mm and ticks of 1/rate; the same of mN·m/rad is mN·m·ms/rad.
inline double leastDamping(double stiffness, double rate, double delay) {
    return stiffness * 1000 / rate * (0.5 + delay);
}

struct DeviceReading {
    Pose X_WT_device;           ///< wanted pose of the tool node, scene frame; if not isValid(), it is bad input
    bool valid = true;          ///< false: no fresh pose; the tick holds and force is zero
    bool finished = false;      ///< a recorded motion has ended (its last pose holds)
    bool fault = false;         ///< the device has failed: zero force until somebody engages it anew
    std::uint32_t buttons = 0;  ///< pressed, a bit each, the first is 1
};

class DeviceControl;

/// Called by the haptic thread only. read() and write() promise real time: no allocation, lock, log or throw.
class Device {
  public:
    virtual ~Device() = default;
    /// Pose at time `t` ms since the start; consecutive calls are `dt` ms apart.
    virtual DeviceReading read(double t, double dt) noexcept = 0;
    /// Wrench on the hand about the tool node's origin, world axes, after the safety stage.
    virtual void write(const Wrench& wrench_o) noexcept = 0;
    /// Zero force at once, from any thread and from a signal handler, while read() or write() may be in progress: the
    /// last act of a process that dies. Async-signal-safe, at the best of the device's ability.
    virtual void releaseForces() noexcept {}
    /// From the next read() on, where the hand is now stands for X_WT. A recorded motion stays where it is.
    virtual void engage(const Pose& /*X_WT*/) noexcept {}
    virtual DeviceLimits limits() const noexcept { return {}; }
    /// When a motion ends that ends whatever it meets, ms; nothing where that is not known.
    virtual std::optional<double> duration() const noexcept { return {}; }
    /// Nothing where they are not known, or the wrench moves nothing.
    virtual std::optional<DeviceDynamics> dynamics() const noexcept { return {}; }
    /// A device whose own scheduler is to drive the ticks calls `tick` on its thread, `rate` Hz, until that returns
    /// false or the scheduler stalls; nothing ticks any more when this returns true. False at once: the caller paces.
    virtual bool drive(double /*rate*/, const std::function<bool()>& /*tick*/) noexcept { return false; }
    /// What the window may ask and change; asked once, before the first tick. Null where there is nothing.
    virtual std::shared_ptr<DeviceControl> control() const { return nullptr; }
};

class Motion;
struct NamedMotion;
class MouseTarget;

/// What a device may need to start; a row takes what it uses.
struct DeviceContext {
    Pose X_WT_start;                              ///< tool node at the start of the scene
    std::optional<Pose> goal;                     ///< where the tool node is to come to rest; nothing without one
    double goalHold = 0;                          ///< ms that it is to stay there
    std::shared_ptr<const Motion> demonstration;  ///< the scene's motion; null if it has none
    std::span<const NamedMotion> motions;         ///< all of the scene's motions, the demonstration first
    std::shared_ptr<MouseTarget> mouse;           ///< fed by the window; null without one
    std::string file;                             ///< what stood behind ':' in --device NAME:FILE
};

struct DeviceCheck {
    bool works = true;
    std::string text = {};  ///< one or more sentences
};

struct DeviceInfo {
    std::string_view name;     ///< as on the command line
    std::string_view summary;  ///< one sentence for help and panels
    /// Throws std::runtime_error with one sentence when it cannot start.
    std::unique_ptr<Device> (*make)(const DeviceContext&);
    /// What works here and what to do about the rest, a line each; null where nothing can be missing.
    DeviceCheck (*examine)() = nullptr;
};

/// demo, hand, insert, mouse, phantom, replay, spacemouse. Adding one is adding a row.
std::span<const DeviceInfo> deviceTable();
const DeviceInfo* findDevice(std::string_view name);

}  // namespace touchstone
