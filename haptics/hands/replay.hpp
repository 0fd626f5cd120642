#pragma once
// A recorded motion as a device, so that several solvers receive the same hand motion.
#include "haptics/device/device.hpp"
#include "haptics/device/device_table.hpp"

namespace touchstone {

/// Row of the device table: follows a CSV file (see readMotion()). Throws std::runtime_error if no file is named or it
/// cannot be read.
std::unique_ptr<Device> makeReplay(const DeviceContext& context);

}  // namespace touchstone
