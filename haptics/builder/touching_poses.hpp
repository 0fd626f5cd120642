#pragma once
// Tests a sphere tree against itself in poses of first contact: what a culling walk costs, and which pairs it misses.
#include <cstdint>
#include <functional>

#include "haptics/builder/sphere_hierarchy.hpp"

namespace touchstone {

/// The fields have the same names and meanings as in TreeMetrics.
struct PoseFigures {
    int poses = 0;
    double testsPerPose = 0, pairsPerPose = 0, pressedPairsPerPose = 0;
    std::int64_t pairsMissed = 0, pressedPairsMissed = 0;
    double walkUs = -1;
};

/// Largest gap between touching leaves, as a share of the diagonal. It only allows for rounding.
constexpr double kTouchShare = 1e-9;
/// Depth of the pressed poses below the touching ones, as a share of the diagonal.
constexpr double kPressShare = 0.01;

/// Draws orientations and directions at random. Moves the tree along each direction to the pose in which its leaves
/// first touch those of its copy, and then further by kPressShare of the diagonal. In each pose, the pairs found by a
/// walk that descends the hierarchy (the larger node first) are compared with all pairs. If `tree` is not null, the
/// hierarchy was made from it: the pairs of its TreeWalk are compared as well, and the walk is timed in the touching
/// poses. The result has fewer than `poses` poses if the drawn directions do not lead to a contact.
PoseFigures measurePoses(const SphereHierarchy& hierarchy, const SphereTree* tree, double diagonal, int poses,
                         std::uint64_t seed, const std::function<void(double)>& beat);

/// The largest travel of the tool from X_OT along the unit vector `direction` at which its leaves touch the obstacle's;
/// beyond it they are apart. -HUGE_VAL if they never touch. Exact up to rounding.
double lastContact(const std::vector<SphereNode>& tool, const std::vector<SphereNode>& obstacle, const Pose& X_OT,
                   const Vec3& direction);

}  // namespace touchstone
