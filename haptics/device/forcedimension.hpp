#pragma once
// An omega, sigma or lambda of Force Dimension: a pose in, force and, with active rotations, torque out.
#include "haptics/device/device.hpp"
#include "haptics/device/device_table.hpp"

namespace touchstone {

/// Row of the device table: forcedimension[:OPTION[,OPTION]...], see ForceDimensionOptions. The hand's motion is mapped
/// into the scene by makeMapped(). If the device cannot start, throws std::runtime_error with what was tried and what
/// to do; without a window also if it is not initialized, since nobody could then agree to the motion that this takes.
std::unique_ptr<Device> makeForceDimension(const DeviceContext& context);
/// Reports what works on this machine, without moving the device.
DeviceCheck examineForceDimension();

}  // namespace touchstone
