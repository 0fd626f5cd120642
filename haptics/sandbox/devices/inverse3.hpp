#pragma once
// A Haply Inverse3, with a VerseGrip if there is one: a 6-DoF pose in, a force out.
#include "haptics/device/device.hpp"
#include "haptics/device/device_table.hpp"

namespace touchstone::sandbox {

/// Row of the device table: inverse3[:OPTION[,OPTION]...], see InverseOptions. The hand's motion is mapped into the
/// scene by makeMapped(). If the device cannot start, throws std::runtime_error with what to do.
std::unique_ptr<Device> makeInverse3(const DeviceContext& context);
/// Reports what works on this machine, with zero force.
DeviceCheck examineInverse3();

}  // namespace touchstone::sandbox
