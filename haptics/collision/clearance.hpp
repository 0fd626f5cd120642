#pragma once
// The smallest gap of two sphere trees, and the free part of a motion, by branch and bound.
#include "haptics/collision/search_budget.hpp"
#include "haptics/collision/tree_walk.hpp"

namespace touchstone {

struct LeafPair {
    int toolLeaf = 0, obstacleLeaf = 0;
};

/// The smallest gap over all leaf pairs, mm, negative if they overlap; `atMost` if no gap is below it. X_OT: tool node
/// in the obstacle's frame. Exact in double for the pair found. `nearest` is a pair to start from, best that of a
/// nearby pose, and is replaced by the pair found; it saves time and does not change the result. Real time, like the
/// other functions of this file: no allocation, lock or throw.
double leastGap(const SphereTree& tool, const SphereTree& obstacle, const Pose& X_OT, double atMost = 1e30,
                LeafPair* nearest = nullptr);

/// leastGap() with atMost = 0, by a walk of the same two trees, which discards pairs without overlap eight at a time.
double deepestGap(const SphereTree& tool, const SphereTree& obstacle, TreeWalk& walk, const Pose& X_OT);

/// The fraction of a motion, at most `atMost`, up to which no pair of leaves touches; pairs that touch or overlap at
/// its start must not get nearer. The tool translates along a straight line while it rotates about `center`. Exact in
/// double without rotation; with rotation, each leaf is allowed to deviate from its straight path by up to
/// reach |turn|²/2, so the result is a lower bound. `reach`: greatest distance of a leaf's center from `center`, mm. A
/// negative number if the search ended because the budget was spent.
double freeShare(const SphereTree& tool, const SphereTree& obstacle, const StraightMotion& motion, const Vec3& center,
                 double reach, double atMost = 1, SearchBudget* budget = nullptr);

}  // namespace touchstone
