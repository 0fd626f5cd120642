#pragma once
// The least gap of two sphere trees, by branch and bound.
#include "haptics/collision/tree_walk.hpp"

namespace touchstone {

struct LeafPair {
    int toolLeaf = 0, obstacleLeaf = 0;
};

/// Least gap over all leaf pairs, mm, negative where they overlap; `atMost` if none is below it. X_OT: tool node in the
/// obstacle's frame. Exact in double for the pair found. `nearest`: a pair to begin with, best that of a pose nearby,
/// and replaced by the one found; it saves time and changes no result. Real time: no allocation, lock or throw.
double leastGap(const SphereTree& tool, const SphereTree& obstacle, const Pose& X_OT, double atMost = 1e30,
                LeafPair* nearest = nullptr);

/// leastGap() with atMost 0, by a walk of the same trees: pairs that do not overlap are left out eight at a time.
double deepestGap(const SphereTree& tool, const SphereTree& obstacle, TreeWalk& walk, const Pose& X_OT);

}  // namespace touchstone
