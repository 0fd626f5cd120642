#pragma once
// Where the goal places the tool: free, inside an obstacle, in mid-air, or out of phase with a thread.
#include <cstddef>
#include <optional>
#include <string>

#include "haptics/device/goal.hpp"
#include "haptics/loop/world.hpp"
#include "haptics/sandbox/measure/background.hpp"

namespace touchstone::sandbox {

/// The obstacle that the tool overlaps most, or, if it overlaps none, the nearest one.
struct PartGap {
    double gap = 0;            ///< mm; negative: how deep the parts overlap; 0: they touch
    Vec3 p_W = Vec3::Zero();   ///< where, mm
    std::size_t obstacle = 0;  ///< of the world
};

/// How overlaps are looked for. A search for a way out does without points inside faces, which take long.
enum class Overlaps { Impossible, Estimated, Measured };

/// The gap between the meshes with the tool at X_WT, at most `atMost` mm. Pre: all parts have meshes.
PartGap partGap(const World& world, const Pose& X_WT, double atMost, Overlaps overlaps = Overlaps::Measured);

/// A turn about the goal's +y, in the middle of the turns that leave the tool free; rad.
struct FreeTurn {
    double turn = 0;
    double play = 0;  ///< from there to either end
};

/// Places beside the goal where the tool overlaps nothing.
struct FreePlaces {
    std::optional<double> raised;  ///< mm along the way out, the least; nothing if that does not help in the hole
    std::optional<FreeTurn> turned;
};
/// Tests poses one by one; thousands of them if nothing helps. Nothing is found if `progress` ended it.
FreePlaces freePlaces(const World& world, const GoalRegion& goal, const MeasureProgress& progress = {});

/// One clause that names what lies inside what, where, and which place beside it is free.
std::string insideClause(const World& world, const PartGap& inside, const FreePlaces& free);

/// One sentence if the tool at its goal lies deeper inside an obstacle than the goal's tolerance, or in mid-air; empty
/// if it does not, or if a part has no mesh.
std::string goalDoubt(const World& world, const GoalRegion& goal);
/// The second half of it: "at its goal the tool is 31 mm from every obstacle: are the parts on one axis?"
std::string midAirDoubt(const World& world, const GoalRegion& goal);

/// A tool in phase with the thread at its goal.
struct ThreadPhase {
    FreeTurn turn;      ///< from the goal as given
    int starts = 1;     ///< of the thread: the tool is in phase as often in a turn
    std::string doubt;  ///< one sentence if there is no such phase, or it is lost when the tool is turned out
};
/// Turns the tool about the goal's +y until its thread lies in the middle of its play. Pre: the goal has a lead; all
/// parts have meshes.
ThreadPhase threadPhase(const World& world, const GoalRegion& goal);

}  // namespace touchstone::sandbox
