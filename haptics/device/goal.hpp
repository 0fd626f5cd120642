#pragma once
// Where the tool should come to rest, and what is known of the way there.
#include <span>
#include <vector>

#include "haptics/math/rigid.hpp"

namespace touchstone {

/// The twist of a rotation about y, rad, modulo steps of 1/`fold` of a turn; 0 if `fold` is 0.
double foldedTwist(const Quat& q, int fold);

/// Where the tool node should come to rest, scene frame. The defaults accept any orientation.
struct GoalRegion {
    Pose X_WT;
    double tolerance = 1;         ///< mm between the origins
    double toleranceAngle = 3.2;  ///< rad
    double hold = 0;              ///< ms that the tool must stay in the region
    double depth = 0;             ///< mm along outAtStart() to where the insertion begins; 0: unknown
    int fold = 1;                 ///< number of equivalent orientations about that axis, evenly spaced; 0: all
    double lead = 0;              ///< mm along that axis per turn, positive for a right-handed thread; 0: no thread
    /// Poses X_GT of the tool on its way in, in the frame of the goal, the outermost first; the goal follows the last.
    /// Between two of them the tool moves along a line and turns about its node's origin. Empty: straight along -y.
    std::vector<Pose> way = {};

    /// Unit directions, in the frame of the goal, in which the tool leaves the goal, and in which it leaves the outer
    /// end of the way: those of the last and the first piece that do more than turn; +y without such a piece.
    Vec3 outAtGoal() const;
    Vec3 outAtStart() const;

    double distance(const Pose& X_WO) const { return (X_WO.p - X_WT.p).norm(); }
    /// The rotation about the axis from the goal to X_WO, less those that lead to an equivalent orientation, rad.
    double twist(const Pose& X_WO) const { return foldedTwist(X_WT.q.conjugate() * X_WO.q, fold); }
    double angle(const Pose& X_WO) const;  ///< to the nearest equivalent orientation, rad
    bool contains(const Pose& X_WO) const { return distance(X_WO) <= tolerance && angle(X_WO) <= toleranceAngle; }
};

/// The poses of a path that are needed to follow it within `tolerance` mm, a turn of 1 rad counting as 45 mm; the first
/// and the last stay (Ramer, Douglas and Peucker). No two neighbors are more than 1 rad apart.
std::vector<Pose> simplified(std::span<const Pose> path, double tolerance);

}  // namespace touchstone
