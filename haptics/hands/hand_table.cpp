#include "haptics/hands/hand_table.hpp"

#include <array>

#include "haptics/hands/demo.hpp"
#include "haptics/hands/held_motion.hpp"
#include "haptics/hands/inserting_hand.hpp"
#include "haptics/hands/mouse.hpp"
#include "haptics/hands/replay.hpp"

namespace touchstone {

std::span<const DeviceInfo> handTable() {
    static constexpr std::array kHands{
        DeviceInfo{"demo",
                   "follows the scene's demonstration, or with demo:NAME another of its motions",
                   Mover::Program,
                   makeDemo,
                   nullptr,
                   {.followsMotion = true}},
        DeviceInfo{
            "hand",
            "a simulated hand that follows the demonstration, as hand:MASS,SPRING,DAMPING,DELAY[,MOTION] in kg, N/m, "
            "N·s/m and ticks",
            Mover::Program, makeHand},
        DeviceInfo{"insert",
                   "a simulated hand that inserts the tool into the hole at the goal by feel, as insert:SEED",
                   Mover::Program,
                   makeInsertingHand,
                   nullptr,
                   {.takesSeed = true}},
        DeviceInfo{"mouse",
                   "a simulated hand that follows the mouse and is held back by the force",
                   Mover::Person,
                   makeMouse,
                   nullptr,
                   {.needsWindow = true}},
        DeviceInfo{"replay",
                   "follows a recording, as replay:FOLDER, or a motion from a CSV file, as replay:FILE",
                   Mover::Program,
                   makeReplay,
                   nullptr,
                   {.followsFile = true}},
        DeviceInfo{"rest", "holds the tool where it is, in a headless run at its start", Mover::Nothing, makeRest},
    };
    return kHands;
}

}  // namespace touchstone
