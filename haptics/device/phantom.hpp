#pragma once
// A Phantom, Touch or other arm through the device layer of OpenHaptics: a 6-DoF pose in, force and torque out.
#include "haptics/device/device.hpp"
#include "haptics/device/device_table.hpp"

namespace touchstone {

/// Row of the device table: phantom[:NAME[,OPTION]...], see PhantomOptions. The hand's motion is mapped into the scene
/// by makeMapped(). If the device cannot start, throws std::runtime_error with what was tried and what to do.
std::unique_ptr<Device> makePhantom(const DeviceContext& context);
/// Reports what works on this machine, without moving the device.
DeviceCheck examinePhantom();

}  // namespace touchstone
