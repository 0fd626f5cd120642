#pragma once
// The devices of the program: those of the core, and those that need more libraries than the core.
#include <span>

#include "haptics/device/device.hpp"

namespace touchstone::sandbox {

/// deviceTable() and the rows of this room, sorted by name. To add a device that needs a library, add a row.
std::span<const DeviceInfo> allDevices();

}  // namespace touchstone::sandbox
