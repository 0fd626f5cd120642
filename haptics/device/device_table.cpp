#include <algorithm>
#include <array>

#include "haptics/device/demo.hpp"
#include "haptics/device/device.hpp"
#include "haptics/device/forcedimension.hpp"
#include "haptics/device/held_motion.hpp"
#include "haptics/device/inserting_hand.hpp"
#include "haptics/device/lab.hpp"
#include "haptics/device/mouse.hpp"
#include "haptics/device/phantom.hpp"
#include "haptics/device/replay.hpp"
#include "haptics/device/spacemouse.hpp"

namespace touchstone {
namespace {

constexpr std::array kDevices{
    DeviceInfo{"demo", "follows the scene's demonstration, or with demo:NAME another of its motions", Mover::Program,
               makeDemo},
    DeviceInfo{"forcedimension",
               "an omega, sigma or lambda through Force Dimension's DHD, as forcedimension:OPTION[,OPTION] (see "
               "docs/devices.md for options)",
               Mover::Person, makeForceDimension, examineForceDimension},
    DeviceInfo{
        "hand",
        "a simulated hand that follows the demonstration, as hand:MASS,SPRING,DAMPING,DELAY[,MOTION] in kg, N/m, "
        "N·s/m and ticks",
        Mover::Program, makeHand},
    DeviceInfo{"insert", "a simulated hand that inserts the tool into the hole at the goal by feel, as insert:SEED",
               Mover::Program, makeInsertingHand},
    DeviceInfo{"lab", "any arm whose program sends poses by UDP, as lab:PORT[,OPTION] (see docs/devices.md)",
               Mover::Person, makeLab, examineLab},
    DeviceInfo{"mouse", "a simulated hand that follows the mouse and is held back by the force", Mover::Person,
               makeMouse},
    DeviceInfo{"phantom",
               "a Phantom or Touch through OpenHaptics, as phantom:NAME[,OPTION] (see docs/devices.md for options)",
               Mover::Person, makePhantom, examinePhantom},
    DeviceInfo{"replay", "follows a recording, as replay:FOLDER, or a motion from a CSV file, as replay:FILE",
               Mover::Program, makeReplay},
    DeviceInfo{"rest", "holds the tool where it is, in a headless run at its start", Mover::Nothing, makeRest},
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
