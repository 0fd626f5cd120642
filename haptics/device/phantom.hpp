#pragma once
// A Phantom, Touch or other arm that OpenHaptics' device layer drives: six axes in, force and torque out.
#include "haptics/device/device.hpp"

namespace touchstone {

/// Row of the device table: phantom[:NAME[,OPTION]...], see PhantomOptions. The hand's motion is mapped into the scene
/// as makeMapped() says. Throws std::runtime_error with what was tried and what to do when it cannot start.
std::unique_ptr<Device> makePhantom(const DeviceContext& context);
/// What works here; moves nothing.
DeviceCheck examinePhantom();

}  // namespace touchstone
