#pragma once
// The interface between the window and a device with hardware: status, reconnecting and the workspace.
#include <string>

#include "haptics/device/workspace.hpp"

namespace touchstone {

/// The state of a device.
struct DeviceStatus {
    enum class State { Running, Fault, Lost, Connecting };
    State state = State::Running;
    std::string text = {};     ///< one sentence: the last event, or which device is running
    std::string details = {};  ///< library, names tried, serial number and so on, one per line
    double temperature = -1;   ///< of the warmest motor, 0 to 1; negative: unknown
    /// Why the user must agree before selfInitialize() is called, one sentence or more; empty: it is not needed, or
    /// nothing can be done.
    std::string consent = {};
    double rate = 0;  ///< measured rate of the device's own scheduler, Hz; 0: unknown
};
const char* name(DeviceStatus::State state);
/// What a device that does not run says of it; empty if it runs.
std::string troubleOf(const DeviceStatus& status);

/// Shared by a device and the window. One thread other than the haptic thread may use it.
class DeviceControl {
  public:
    virtual ~DeviceControl() = default;
    virtual DeviceStatus status() const { return {}; }
    /// Tries to reconnect a lost device on a separate thread; status() reports the progress. The force stays zero until
    /// the user engages the device.
    virtual void reconnect() {}
    /// Initializes a device that must move by itself for that, on a separate thread like reconnect(). Call it only
    /// after the user has agreed to DeviceStatus::consent.
    virtual void selfInitialize() {}
    /// Which part of a Workspace the device applies: nothing, the axes (q_WD), or everything.
    enum class Maps { Nothing, Axes, All };
    virtual Maps maps() const { return Maps::Nothing; }
    virtual Workspace workspace() const { return {}; }
    /// Takes effect at the next tick, without a jump of the tool. The scale is applied only before the first reading.
    virtual void setWorkspace(const Workspace&) {}
};

}  // namespace touchstone
