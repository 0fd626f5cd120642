#pragma once
// One tool leaf against a bucket of eight obstacle leaves, exactly.
#include "haptics/collision/sphere_tree.hpp"
#include "haptics/math/simd.hpp"

namespace touchstone {

/// Offsets of the centres from obstacle to tool, their distance, the gap; mm, a lane an obstacle leaf.
struct LeafGaps {
    simd::Double8 dx, dy, dz, distance, gap;
};

/// In double from the leaves as stored. c_O: centre of the tool leaf in the obstacle's frame.
inline LeafGaps leafGaps(const Vec3& c_O, double radius, const SphereTree& obstacle, int bucket) {
    using namespace simd;
    const TreeLevel& leaves = obstacle.levels[0];
    const int first = bucket * SphereTree::kBranching;
    LeafGaps g;
    g.dx = splat(c_O.x()) - toDouble(load(&leaves.x[first]));
    g.dy = splat(c_O.y()) - toDouble(load(&leaves.y[first]));
    g.dz = splat(c_O.z()) - toDouble(load(&leaves.z[first]));
    g.distance = simd::sqrt(g.dx * g.dx + g.dy * g.dy + g.dz * g.dz);
    g.gap = g.distance - (toDouble(load(&leaves.r[first])) + splat(radius));
    return g;
}

/// The gap of one pair alone, mm. X_OT: tool node in the obstacle's frame.
inline double leafGap(const Sphere& tool, const Sphere& obstacle, const Pose& X_OT) {
    return (X_OT * tool.center() - obstacle.center()).norm() - (double(tool.r) + double(obstacle.r));
}

}  // namespace touchstone
