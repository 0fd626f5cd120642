#pragma once
// The least gap of two sphere trees, and how far one can go, by branch and bound.
#include "haptics/collision/tree_walk.hpp"

namespace touchstone {

struct LeafPair {
    int toolLeaf = 0, obstacleLeaf = 0;
};

/// Least gap over all leaf pairs, mm, negative where they overlap; `atMost` if none is below it. X_OT: tool node in the
/// obstacle's frame. Exact in double for the pair found. `nearest`: a pair to begin with, best that of a pose nearby,
/// and replaced by the one found; it saves time and changes no result. This and the others are real time: no
/// allocation, lock or throw.
double leastGap(const SphereTree& tool, const SphereTree& obstacle, const Pose& X_OT, double atMost = 1e30,
                LeafPair* nearest = nullptr);

/// Whether a pair has a gap below that, mm.
bool anyWithin(const SphereTree& tool, const SphereTree& obstacle, const Pose& X_OT, double margin);

/// leastGap() with atMost 0, by a walk of the same trees: pairs that do not overlap are left out eight at a time.
double deepestGap(const SphereTree& tool, const SphereTree& obstacle, TreeWalk& walk, const Pose& X_OT);

/// The share of a way, `atMost` at most, up to which no pair of leaves meets; pairs that touch or overlap at its start
/// must not get nearer. The way goes from its pose straight on while it turns about the tool's centre. Exact in double
/// where it does not turn; else what a leaf leaves its own straight way by, up to reach |turn|²/2, is taken as met.
/// `reach`: SphereTree::reach() of the tool, mm.
double freeShare(const SphereTree& tool, const SphereTree& obstacle, const Course& way, double reach,
                 double atMost = 1);

}  // namespace touchstone
