#pragma once
// The scene's demonstration as a device.
#include "haptics/device/device.hpp"
#include "haptics/device/motion.hpp"

namespace touchstone {

/// The scene's motion of that name; of no name, its demonstration. Throws std::runtime_error with one sentence when
/// the scene has none.
std::shared_ptr<const Motion> chosenMotion(const DeviceContext& context, const std::string& name);

/// Row of the device table: follows the demonstration, or with demo:NAME another of the scene's motions. Throws
/// std::runtime_error when the scene has none.
std::unique_ptr<Device> makeDemo(const DeviceContext& context);

}  // namespace touchstone
