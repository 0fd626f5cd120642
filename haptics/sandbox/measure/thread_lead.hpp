#pragma once
// What the facets of a thread's meshes make of its lead.
#include <optional>
#include <string>

#include "haptics/device/goal.hpp"
#include "haptics/loop/world.hpp"
#include "haptics/sandbox/measure/background.hpp"

namespace touchstone::sandbox {

/// The steepness at which a tool that is pressed or pulled along a thread climbs or descends, over the lead. An axial
/// force turns the tool as long as the facets in contact are steeper than friction, so that where they are flattest
/// the thread holds: from `least` times the coefficient of friction that the lead asks for.
struct ThreadLead {
    double least = 1, most = 1;
};
/// One clause about it, and, where the facets decide from which friction on the thread holds, what to do.
std::string facetClause(const ThreadLead& lead);

/// Turns the tool by 5 degrees, a lead above its goal, pressed and pulled without friction, and compares the torque at
/// rest with the force (by energy, torque over force is the rise over the turn). Allocates; takes up to some seconds.
/// Nothing without a lead, if the tool is not held by meshes there, or if `progress` ended it.
std::optional<ThreadLead> threadLead(const World& world, const GoalRegion& goal, double contactDistance,
                                     const MeasureProgress& progress = {});

}  // namespace touchstone::sandbox
