#pragma once
// The devices of the program: those of the core, and those that need more libraries than the core.
#include <span>

#include "haptics/device/device.hpp"
#include "haptics/device/device_table.hpp"

namespace touchstone::sandbox {

/// deviceTable(), handTable() and the rows of this room, sorted by name. To add a device that needs a library, add a
/// row.
std::span<const DeviceInfo> allDevices();

}  // namespace touchstone::sandbox
