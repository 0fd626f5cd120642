#pragma once
// Where a part goes, found from the exact surfaces of CAD parts: a goal with its axis, fold and lead, and why.
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/transforms.hpp"
#include "haptics/sandbox/scene/mate_seat.hpp"

namespace touchstone::sandbox {

/// A place where the tool fits. Lengths in meters, in the frame of the placements.
struct MateProposal {
    engine::RigidPart pose;            ///< takes the tool from its place to the goal
    bool modeled = false;              ///< the tool's place is the goal
    glm::dvec3 point{0};               ///< on the axis
    glm::dvec3 out{0};                 ///< unit, along the axis: the way out
    int fold = 1;                      ///< number of equivalent orientations about the axis; 0: all
    double lead = 0;                   ///< travel per turn, positive for a right-handed thread; 0: no thread
    double clearance = 0;              ///< between the radii of hole and shaft; below 0: they are drawn to interfere
    std::vector<std::string> reasons;  ///< clauses, each of which completes a sentence of its own
    std::vector<std::string> doubts;   ///< sentences about what the surfaces do not say
};

/// The best mate of the tool's parts with the obstacles: cylinders or threads about a common axis, keys and flats that
/// meet in phase about it, and the planes and cones at which the tool stops. A tool that is modeled in such a place
/// stays there. Needs triangles of plane faces. Nothing if no shaft of one side goes into a hole of the other.
std::optional<MateProposal> proposeMate(std::span<const MatePart> tool, std::span<const MatePart> obstacles,
                                        const MateConstraints& given = {});

}  // namespace touchstone::sandbox
