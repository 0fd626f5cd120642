#pragma once
// What the program knows of each device that a user may choose by name, and the table of those with hardware.
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "haptics/device/device.hpp"
#include "haptics/device/goal.hpp"

namespace touchstone {

class Motion;
struct NamedMotion;
class MouseTarget;

/// Everything that a device may need to start. Each device uses only some of it.
struct DeviceContext {
    Pose X_WT_start;                              ///< tool node at the start of the scene
    std::optional<GoalRegion> goal;               ///< nothing if the scene has no goal
    std::shared_ptr<const Motion> demonstration;  ///< the scene's main motion; null if it has none
    std::span<const NamedMotion> motions;         ///< all of the scene's motions, the demonstration first
    std::shared_ptr<MouseTarget> mouse;           ///< written by the window; null without a window
    std::string file;                             ///< the text after ':' in --device NAME:FILE
};

struct DeviceCheck {
    bool works = true;
    std::string text = {};  ///< one or more sentences
};

/// What moves a device.
enum class Mover {
    Nothing,
    Program,  ///< a motion or a simulated hand: a run needs no clock, and repeats to the bit
    Person,   ///< or a machine outside: a run is paced by the clock, and none repeats another
};

/// What the program must know of a device beyond Device.
struct DeviceTraits {
    bool needsWindow = false;    ///< its pose comes from the window: DeviceContext::mouse
    bool followsMotion = false;  ///< it is where a motion of the scene is, and meets that motion's expected outcome
    bool followsFile =
        false;  ///< it follows a recording or a motion from a file, which the window asks for as for replay
    bool takesSeed = false;  ///< the text after ':' is a seed, so that trials can differ
};

struct DeviceInfo {
    std::string_view name;     ///< as on the command line
    std::string_view summary;  ///< one sentence for help and panels
    Mover mover;
    /// Makes the device. Throws std::runtime_error with one sentence if it cannot start.
    std::unique_ptr<Device> (*make)(const DeviceContext&);
    /// Reports what works on this machine and what to do about the rest, one item per line; null if nothing can be
    /// missing.
    DeviceCheck (*examine)() = nullptr;
    DeviceTraits traits = {};
};

/// Devices with hardware. To add one, add a row. handTable() of haptics/hands has those without; the program's table,
/// with them and the devices that need more libraries, is allDevices() of haptics/sandbox/devices.
std::span<const DeviceInfo> deviceTable();
/// Row of the table, or null.
const DeviceInfo* findDevice(std::string_view name, std::span<const DeviceInfo> table);

}  // namespace touchstone
