#pragma once
// A SpaceMouse through libspnav. It sets the velocity of the tool, not its pose.
#include "haptics/device/device.hpp"
#include "haptics/device/device_table.hpp"

namespace touchstone {

/// Rate for an axis value of libspnav, -1 to 1. It is zero in the dead band around rest and grows linearly up to the
/// full deflection.
double spaceMouseRate(int value);

/// Row of the device table: spacemouse[:SPEED], in mm/s at full deflection, 50 by default. The angular speed is
/// proportional, with 1 rad/s at 50. The cap's axes (right, up and toward the user) are those of the scene, rotated by
/// Workspace::q_WD. There is no force feedback; where a contact holds the tool back, the desired pose slows down and
/// stops. Throws std::runtime_error with one sentence if libspnav or its daemon is missing.
std::unique_ptr<Device> makeSpaceMouse(const DeviceContext& context);
/// Reports what works on this machine.
DeviceCheck examineSpaceMouse();

}  // namespace touchstone
