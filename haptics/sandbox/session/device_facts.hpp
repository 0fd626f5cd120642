#pragma once
// The device that runs, as panels show it.
#include <memory>
#include <optional>
#include <string>

#include "haptics/device/control.hpp"
#include "haptics/device/mouse.hpp"

namespace touchstone::sandbox {

/// What a device says of itself.
struct DeviceFacts {
    DeviceLimits limits;
    std::optional<DeviceDynamics> dynamics = {};  ///< nothing where it is not known, or the wrench moves nothing
    std::optional<DeviceStatus> status = {};      ///< of one with hardware behind it
    double scale = 1;                             ///< mm of the tool per mm of the hand
};

/// The device that holds the tool.
struct SessionDevice {
    std::string choice;                           ///< NAME or NAME:FILE
    DeviceFacts facts = {};                       ///< limits as the hand has them
    std::shared_ptr<DeviceControl> control = {};  ///< what can be asked of it; null where there is nothing to ask
    std::shared_ptr<MouseTarget> mouse = {};      ///< where the mouse's hand is to go; null for any other device
    std::string trouble = {};                     ///< why the device chosen last could not start; empty when it did
};

}  // namespace touchstone::sandbox
