#pragma once
// The scene's demonstration as a device.
#include "haptics/device/device.hpp"

namespace touchstone {

/// Row of the device table: follows the demonstration. Throws std::runtime_error when the scene has none.
std::unique_ptr<Device> makeDemo(const DeviceContext& context);

}  // namespace touchstone
