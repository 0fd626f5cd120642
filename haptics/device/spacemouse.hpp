#pragma once
// A SpaceMouse through libspnav: it says how fast the tool is to go, not where.
#include "haptics/device/device.hpp"

namespace touchstone {

/// Rate for an axis value of libspnav, -1 to 1: zero in the dead band around rest, then growing linearly to full
/// deflection.
double spaceMouseRate(int value);

/// Row of the device table: spacemouse[:SPEED], mm/s at full deflection, 50 by default; turns go with it, 1 rad/s
/// at 50. The cap's axes, right, up and towards the user, are those of the scene, turned by Workspace::q_WD. There is
/// no force to feel; where the tool is held back the wanted pose slows down and stops against it. Throws
/// std::runtime_error with one sentence when libspnav or its daemon is missing.
std::unique_ptr<Device> makeSpaceMouse(const DeviceContext& context);
/// What works here.
DeviceCheck examineSpaceMouse();

}  // namespace touchstone
