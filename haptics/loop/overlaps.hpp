#pragma once
// Leaf pairs that overlap, for the modes that need no other pairs. Internal to step().
#include <bit>

#include "haptics/collision/leaf_gaps.hpp"
#include "haptics/loop/tick_memory.hpp"

namespace touchstone {

/// Calls visit(obstacle, tool leaf, obstacle leaf, gap in mm) for every pair that overlaps with the tool at `q`, a pose
/// of C, in a reproducible order.
template <class Visit>
void forOverlaps(TickState::Impl& s, const Pose& q, Visit&& visit) {
    for (int k = 0; k < int(s.walks.size()); ++k) {
        const Pose X_OT = s.inObstacle(k, q);
        const Mat3 R = X_OT.R();
        const SphereTree& obstacle = *s.world->obstacles[k].part.spheres;
        s.walks[k].run({X_OT, 0}, [&](const PairEntry* entries, int count) {
            for (int i = 0; i < count; ++i) {
                const auto [toolLeaf, bucket] = entries[i];
                const Sphere leaf = s.world->tool.spheres->leaf(toolLeaf);
                const LeafGaps gaps = leafGaps(R * Vec3(leaf.x, leaf.y, leaf.z) + X_OT.p, leaf.r, obstacle, bucket);
                const simd::Double8 zero = simd::splat(0.0);
                simd::Mask mask = simd::lessEqual(gaps.gap, zero) & ~simd::lessEqual(zero, gaps.gap);  // gap < 0
                for (; mask; mask &= mask - 1) {
                    const int lane = std::countr_zero(mask);
                    visit(k, toolLeaf, bucket * SphereTree::kBranching + lane, gaps.gap[lane]);
                }
            }
        });
    }
}

}  // namespace touchstone
