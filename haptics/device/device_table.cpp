#include "haptics/device/device_table.hpp"

#include <algorithm>
#include <array>

#include "haptics/device/forcedimension.hpp"
#include "haptics/device/lab.hpp"
#include "haptics/device/phantom.hpp"
#include "haptics/device/spacemouse.hpp"

namespace touchstone {
namespace {

constexpr std::array kDevices{
    DeviceInfo{"forcedimension",
               "an omega, sigma or lambda through Force Dimension's DHD, as forcedimension:OPTION[,OPTION] (see "
               "docs/devices.md for options)",
               Mover::Person, makeForceDimension, examineForceDimension},
    DeviceInfo{"lab", "any arm whose program sends poses by UDP, as lab:PORT[,OPTION] (see docs/devices.md)",
               Mover::Person, makeLab, examineLab},
    DeviceInfo{"phantom",
               "a Phantom or Touch through OpenHaptics, as phantom:NAME[,OPTION] (see docs/devices.md for options)",
               Mover::Person, makePhantom, examinePhantom},
    DeviceInfo{"spacemouse", "a SpaceMouse through libspnav steers the tool, as spacemouse:SPEED in mm/s",
               Mover::Person, makeSpaceMouse, examineSpaceMouse},
};

}  // namespace

std::span<const DeviceInfo> deviceTable() { return kDevices; }

const DeviceInfo* findDevice(std::string_view name, std::span<const DeviceInfo> table) {
    const auto found = std::find_if(table.begin(), table.end(), [&](const DeviceInfo& d) { return d.name == name; });
    return found == table.end() ? nullptr : &*found;
}

}  // namespace touchstone
