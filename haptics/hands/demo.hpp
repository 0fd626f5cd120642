#pragma once
// Devices that follow the scene's demonstration, or rest where the tool starts.
#include "haptics/device/device.hpp"
#include "haptics/device/device_table.hpp"
#include "haptics/hands/motion.hpp"

namespace touchstone {

/// The scene's motion with that name; for an empty name, its demonstration. Throws std::runtime_error with one sentence
/// if the scene has no such motion.
std::shared_ptr<const Motion> chosenMotion(const DeviceContext& context, const std::string& name);

/// Row of the device table: follows the demonstration, or with demo:NAME another motion of the scene. Throws
/// std::runtime_error if the scene has no such motion.
std::unique_ptr<Device> makeDemo(const DeviceContext& context);

/// Row of the device table: holds the tool where it starts, as a motion without duration.
std::unique_ptr<Device> makeRest(const DeviceContext& context);

}  // namespace touchstone
