#pragma once
// Where a tool fits on the axes of obstacles: a search over cylinders and threads, for proposeMate().
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "engine/scene/transforms.hpp"
#include "haptics/sandbox/scene/mate_faces.hpp"

namespace touchstone::sandbox {

inline constexpr double kSamePlace = 2e-6;  ///< m: points this near agree, given the digits of files

/// What is known already and need not be found.
struct MateConstraints {
    enum class Tool {
        Anywhere,  ///< it may be turned and moved
        OnAxis,    ///< it lies on its axis, and may be moved along it
        AtGoal     ///< it is modeled where it ends
    };
    Tool tool = Tool::Anywhere;
    std::optional<glm::dvec3> out;  ///< the way out, a unit vector
    double lead = 0;                ///< of a thread that is drawn as a cylinder, m per turn
};

/// Two cylinders or threads about a common axis, one of the tool.
struct MatePair {
    MateBand tool, obstacle;
    const MateBand& shaft() const { return tool.hollow ? obstacle : tool; }
    const MateBand& hole() const { return tool.hollow ? tool : obstacle; }
    bool threads() const { return tool.lead != 0 && obstacle.lead != 0; }
    /// Between the radii; of threads, between crests and roots. Below 0: the shaft is thicker.
    double clearance() const;
    /// Whether one goes into the other, on a thread of that lead if it is not 0.
    bool fits(double lead) const;
    /// Long, thick and close fits count more.
    double weight(double length) const;
    /// The length that both cover, with the tool at that travel.
    double engaged(double travel) const;
};

/// What the tool meets on its way in.
struct MateStop {
    double travel = 0;
    bool cone = false;     ///< a cone in its seat; else two planes
    std::size_t part = 0;  ///< of the obstacles
    bool lowest = false;   ///< the tool's lowest plane meets it, as at the floor of a hole
};

/// A tool's axis on an obstacle's axis.
struct MateSeat {
    MateFrame tool, obstacle;     ///< the way out is up in both
    double turn = 0, travel = 0;  ///< of the tool's frame, about and along the obstacle's
    bool modeled = false;         ///< the tool's own place
    std::size_t sides = 0;        ///< planes and cylinders beside the axis that meet
    std::optional<MateStop> stop;
    MatePair main;
    double engaged = 0;  ///< of the main pair
    double weight = 0;
    double moved = 0;  ///< how far the tool moves to get there, or, if it is modeled there, out
    int fold = 1;      ///< see MateProposal
};

/// Takes the tool from its place to the seat.
engine::RigidPart poseOf(const MateSeat& seat);

/// The tool's own place if it fits there, else the seat with the longest and closest fit.
std::optional<MateSeat> findSeat(std::span<const MatePart> tool, std::span<const MatePart> obstacles,
                                 const MateConstraints& given);

}  // namespace touchstone::sandbox
