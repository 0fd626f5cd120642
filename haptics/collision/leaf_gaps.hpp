#pragma once
// Exact gaps of one tool leaf and a bucket of eight obstacle leaves.
#include "haptics/collision/sphere_tree.hpp"
#include "haptics/math/simd.hpp"

namespace touchstone {

/// Offset of the tool leaf's center from each obstacle leaf's center, their distance and the gap; mm, one lane for each
/// obstacle leaf.
struct LeafGaps {
    simd::Double8 dx, dy, dz, distance, gap;
};

/// Computed in double from the leaves as stored. c_O: center of the tool leaf in the obstacle's frame.
inline LeafGaps leafGaps(const Vec3& c_O, double radius, const SphereTree& obstacle, int bucket) {
    using namespace simd;
    const TreeLevel& leaves = obstacle.levels[0];
    const int first = bucket * SphereTree::kBranching;
    LeafGaps g;
    g.dx = splat(c_O.x()) - toDouble(load(&leaves.x[first]));
    g.dy = splat(c_O.y()) - toDouble(load(&leaves.y[first]));
    g.dz = splat(c_O.z()) - toDouble(load(&leaves.z[first]));
    g.distance = simd::sqrt(sumOfProducts(g.dx, g.dx, g.dy, g.dy, g.dz, g.dz));
    g.gap = g.distance - (toDouble(load(&leaves.r[first])) + splat(radius));
    return g;
}

/// The gap of one pair, mm. X_OT: tool node in the obstacle's frame.
inline double leafGap(const Sphere& tool, const Sphere& obstacle, const Pose& X_OT) {
    return (X_OT * tool.center() - obstacle.center()).norm() - (double(tool.r) + double(obstacle.r));
}

}  // namespace touchstone
