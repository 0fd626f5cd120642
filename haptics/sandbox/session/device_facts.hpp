#pragma once
// The device that runs, as panels show it.
#include <optional>

#include "haptics/device/control.hpp"

namespace touchstone::sandbox {

/// What a device says of itself.
struct DeviceFacts {
    DeviceLimits limits;
    std::optional<DeviceDynamics> dynamics = {};  ///< nothing where it is not known, or the wrench moves nothing
    std::optional<DeviceStatus> status = {};      ///< of one with hardware behind it
    double scale = 1;                             ///< mm of the tool per mm of the hand
};

}  // namespace touchstone::sandbox
