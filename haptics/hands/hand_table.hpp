#pragma once
// Devices without hardware: simulated hands, and motions that a device follows.
#include <span>

#include "haptics/device/device_table.hpp"

namespace touchstone {

/// To add a hand, add a row.
std::span<const DeviceInfo> handTable();

}  // namespace touchstone
