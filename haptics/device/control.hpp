#pragma once
// What the window and a device with hardware behind it say to each other.
#include <string>

#include "haptics/device/workspace.hpp"

namespace touchstone {

/// How a device stands.
struct DeviceStatus {
    enum class State { Running, Fault, Lost, Connecting };
    State state = State::Running;
    std::string text = {};     ///< one sentence: what happened last, or what runs
    std::string details = {};  ///< library, names tried, serial number and so on, a line each
    double temperature = -1;   ///< of the warmest motor, 0 to 1; negative: not known
    double rate = 0;           ///< of the device's own scheduler as measured, Hz; 0: not known
};
const char* name(DeviceStatus::State state);

/// Shared by a device and the window, for any one thread besides the haptic one.
class DeviceControl {
  public:
    virtual ~DeviceControl() = default;
    virtual DeviceStatus status() const { return {}; }
    /// Tries to get a lost device back, on a thread of its own; status() tells how that goes. The force stays zero
    /// until somebody engages it.
    virtual void reconnect() {}
    /// How much of a Workspace it follows; what is above stays as it is by default.
    enum class Maps { Nothing, Axes, All };
    virtual Maps maps() const { return Maps::Nothing; }
    virtual Workspace workspace() const { return {}; }
    /// Acts at the next tick, without a jump of the tool; the scale only on a device that no loop has yet.
    virtual void setWorkspace(const Workspace&) {}
};

}  // namespace touchstone
