#include "haptics/sandbox/devices/all_devices.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "haptics/hands/hand_table.hpp"
#include "haptics/sandbox/devices/inverse3.hpp"

namespace touchstone::sandbox {
namespace {

constexpr std::array kDevices{
    DeviceInfo{"inverse3",
               "a Haply Inverse3, with a VerseGrip, through Haply's Inverse Service; force only (see docs/devices.md "
               "for options)",
               Mover::Person, makeInverse3, examineInverse3},
};

}  // namespace

std::span<const DeviceInfo> allDevices() {
    static const std::vector<DeviceInfo> all = [] {
        std::vector<DeviceInfo> rows;
        for (const std::span<const DeviceInfo> table :
             {deviceTable(), handTable(), std::span<const DeviceInfo>(kDevices)})
            rows.insert(rows.end(), table.begin(), table.end());
        std::sort(rows.begin(), rows.end(), [](const DeviceInfo& a, const DeviceInfo& b) { return a.name < b.name; });
        return rows;
    }();
    return all;
}

}  // namespace touchstone::sandbox
