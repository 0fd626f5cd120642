#pragma once
// Any arm over the network: a program sends the pose of the hand by UDP and receives the wrench.
#include "haptics/device/device.hpp"
#include "haptics/device/device_table.hpp"

namespace touchstone {

/// Row of the device table: lab[:PORT[,OPTION]...], see LabOptions. The hand's motion is mapped into the scene by
/// makeMapped(). If the port cannot be opened, throws std::runtime_error with the reason and what to do.
std::unique_ptr<Device> makeLab(const DeviceContext& context);
/// Reports whether the default port can be opened.
DeviceCheck examineLab();

}  // namespace touchstone
