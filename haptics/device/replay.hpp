#pragma once
// A recorded motion as a device: feeds two solvers the same hand.
#include "haptics/device/device.hpp"

namespace touchstone {

/// Row of the device table: follows the CSV file (see readMotion). Throws std::runtime_error when no file is named or
/// it cannot be read.
std::unique_ptr<Device> makeReplay(const DeviceContext& context);

}  // namespace touchstone
