#pragma once
// The running device, as the panels show it.
#include <memory>
#include <optional>
#include <string>

#include "haptics/device/control.hpp"
#include "haptics/hands/mouse.hpp"

namespace touchstone::sandbox {

/// What a device reports about itself.
struct DeviceFacts {
    DeviceLimits limits;
    std::optional<DeviceDynamics> dynamics = {};  ///< absent if unknown, or if the wrench moves nothing
    std::optional<DeviceStatus> status = {};      ///< absent without hardware
    double scale = 1;                             ///< mm of the tool per mm of the hand
};

/// The device that holds the tool.
struct SessionDevice {
    std::string choice;                           ///< NAME or NAME:FILE
    DeviceFacts facts = {};                       ///< limits as the hand has them
    std::shared_ptr<DeviceControl> control = {};  ///< its controls; null if it has none
    std::shared_ptr<MouseTarget> mouse = {};      ///< target of the mouse's hand; null for other devices
    std::string trouble = {};                     ///< why the last chosen device could not start; empty on success
};

}  // namespace touchstone::sandbox
