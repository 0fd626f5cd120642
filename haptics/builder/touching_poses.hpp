#pragma once
// A sphere tree against itself in poses of first contact: what a walk that culls costs, and what it misses.
#include <cstdint>
#include <functional>

#include "haptics/builder/sphere_hierarchy.hpp"

namespace touchstone {

/// See TreeMetrics, whose names these are.
struct PoseFigures {
    int poses = 0;
    double testsPerPose = 0, pairsPerPose = 0, pressedPairsPerPose = 0;
    std::int64_t pairsMissed = 0, pressedPairsMissed = 0;
    double walkUs = -1;
};

/// Two leaves touch where their gap is at most this share of the diagonal: rounding, no more.
constexpr double kTouchShare = 1e-9;
/// How far the pressed poses lie below the touching ones.
constexpr double kPressShare = 0.01;

/// Draws orientations and directions, brings the tree along the direction to where its leaves first touch those of its
/// copy, and then kPressShare of the diagonal further. In each pose the walk that descends the hierarchy as it stands
/// (the larger node first) is held against all pairs. `tree`, if not null, is the one that the hierarchy was made of:
/// its TreeWalk is held against them, too, and timed at the touching poses. Fewer poses than asked for, if the drawn
/// directions lead the body through itself.
PoseFigures measurePoses(const SphereHierarchy& hierarchy, const SphereTree* tree, double diagonal, int poses,
                         std::uint64_t seed, const std::function<void(double)>& beat);

/// How far along the unit vector `direction` the tool, at X_OT, can be moved until its leaves touch the obstacle's for
/// the last time: beyond it they are apart. -HUGE_VAL if they never touch on the way. Exact up to rounding.
double lastContact(const std::vector<SphereNode>& tool, const std::vector<SphereNode>& obstacle, const Pose& X_OT,
                   const Vec3& direction);

}  // namespace touchstone
