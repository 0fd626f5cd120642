#include "haptics/sandbox/devices/all_devices.hpp"

#include <algorithm>
#include <array>
#include <vector>

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
        std::vector<DeviceInfo> rows(deviceTable().begin(), deviceTable().end());
        rows.insert(rows.end(), kDevices.begin(), kDevices.end());
        std::sort(rows.begin(), rows.end(), [](const DeviceInfo& a, const DeviceInfo& b) { return a.name < b.name; });
        return rows;
    }();
    return all;
}

}  // namespace touchstone::sandbox
