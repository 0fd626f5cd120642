#include "haptics/collision/clearance.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "haptics/collision/leaf_gaps.hpp"

namespace touchstone {
namespace {

using namespace simd;

constexpr double kRounding = 1e-9;  // mm: more than two ways to compute a gap can differ by

/// Depth first, nearest children first; a pair of blocks is left out when its lower bound is no less than the best gap
/// so far.
class Search {
  public:
    Search(const SphereTree& tool, const SphereTree& obstacle, const Pose& X_OT, double atMost, LeafPair* nearest)
        : tool_(tool),
          obstacle_(obstacle),
          X_OT_(X_OT),
          R_(X_OT.R()),
          guard_(floatGuard(tool, obstacle, X_OT)),
          best_(atMost),
          nearest_(nearest) {}

    double run() {
        if (nearest_) test(nearest_->toolLeaf, nearest_->obstacleLeaf);
        const int a = int(tool_.levels.size()) - 1, b = int(obstacle_.levels.size()) - 1;
        const Sphere t = tool_.block(a, 0), o = obstacle_.block(b, 0);
        if ((place(t) - Vec3(o.x, o.y, o.z)).norm() - t.r - o.r < best_) descend(a, 0, b, 0);
        return best_;
    }

  private:
    Vec3 place(const Sphere& s) const { return R_ * Vec3(s.x, s.y, s.z) + X_OT_.p; }

    void test(int i, int j) {
        const double gap = leafGap(tool_, i, obstacle_, j, X_OT_);
        if (!(gap < best_)) return;
        best_ = gap;
        if (nearest_) *nearest_ = {i, j};
    }

    void descend(int a, int i, int b, int j) {
        if (a == 0 && b == 0) return test(i, j);
        const bool descendObstacle = a == 0 || (b > 0 && obstacle_.levels[b].r[j] >= tool_.levels[a].r[i]);
        const int children = (descendObstacle ? j : i) * SphereTree::kBranching;
        const Float8 bound = descendObstacle ? boundsToObstacle(tool_.block(a, i), obstacle_.levels[b - 1], children)
                                             : boundsToTool(tool_.levels[a - 1], children, obstacle_.levels[b], j);
        // The lanes that may hold less, the least first.
        std::array<int, 8> order;
        int count = 0;
        for (Mask open = lessEqual(bound, splat(float(best_))); open; open &= open - 1) {
            const int lane = std::countr_zero(open);
            int at = count++;
            for (; at > 0 && bound[order[at - 1]] > bound[lane]; --at) order[at] = order[at - 1];
            order[at] = lane;
        }
        for (int n = 0; n < count && double(bound[order[n]]) < best_; ++n)
            if (descendObstacle)
                descend(a, i, b - 1, children + order[n]);
            else
                descend(a - 1, children + order[n], b, j);
    }

    /// A box bounds how far leaves are apart, not how deep they overlap.
    static Float8 tighter(Float8 sphere, Float8 box) { return box > 0.0f ? max(sphere, box) : sphere; }

    /// Lower bounds of the leaf gaps: to the spheres of the obstacle's blocks and to their rounded boxes.
    Float8 boundsToObstacle(const Sphere& tool, const TreeLevel& level, int first) const {
        const Vec3 c = place(tool);
        Float8 apart2 = splat(0.0f), outside2 = splat(0.0f);
        const float* centers[3] = {&level.x[first], &level.y[first], &level.z[first]};
        for (int k = 0; k < 3; ++k) {
            const Float8 x = splat(float(c[k])), apart = load(centers[k]) - x;
            const Float8 outside = max(max(load(&level.lo[k][first]) - x, x - load(&level.hi[k][first])), splat(0.0f));
            apart2 += apart * apart;
            outside2 += outside * outside;
        }
        return tighter(simd::sqrt(apart2) - load(&level.r[first]) - splat(tool.r),
                       simd::sqrt(outside2) - load(&level.round[first]) - splat(tool.r)) -
               splat(guard_);
    }

    Float8 boundsToTool(const TreeLevel& level, int first, const TreeLevel& obstacle, int block) const {
        const Float8 x = load(&level.x[first]), y = load(&level.y[first]), z = load(&level.z[first]);
        Float8 apart2 = splat(0.0f), outside2 = splat(0.0f);
        const float center[3] = {obstacle.x[block], obstacle.y[block], obstacle.z[block]};
        for (int k = 0; k < 3; ++k) {
            const Float8 c = float(R_(k, 0)) * x + float(R_(k, 1)) * y + float(R_(k, 2)) * z + float(X_OT_.p[k]);
            const Float8 apart = c - splat(center[k]);
            const Float8 outside =
                max(max(splat(obstacle.lo[k][block]) - c, c - splat(obstacle.hi[k][block])), splat(0.0f));
            apart2 += apart * apart;
            outside2 += outside * outside;
        }
        const Float8 r = load(&level.r[first]);
        return tighter(simd::sqrt(apart2) - splat(obstacle.r[block]) - r,
                       simd::sqrt(outside2) - splat(obstacle.round[block]) - r) -
               splat(guard_);
    }

    const SphereTree& tool_;
    const SphereTree& obstacle_;
    const Pose& X_OT_;
    const Mat3 R_;
    const float guard_;
    double best_;
    LeafPair* nearest_;
};

}  // namespace

double leastGap(const SphereTree& tool, const SphereTree& obstacle, const Pose& X_OT, double atMost,
                LeafPair* nearest) {
    return Search(tool, obstacle, X_OT, atMost, nearest).run();
}

double deepestGap(const SphereTree& tool, const SphereTree& obstacle, TreeWalk& walk, const Pose& X_OT) {
    const Mat3 R = X_OT.R();
    double best = 0;
    int placed = -1;
    Vec3 c = Vec3::Zero();
    double radius = 0;
    walk.run({X_OT, 0}, [&](const LeafBucket* entries, int count) {
        for (const LeafBucket* entry = entries; entry != entries + count; ++entry) {
            if (entry->toolLeaf != placed) {
                placed = entry->toolLeaf;
                const Sphere s = tool.leaf(placed);
                c = R * Vec3(s.x, s.y, s.z) + X_OT.p;
                radius = s.r;
            }
            Mask deeper = lessEqual(leafGaps(c, radius, obstacle, entry->bucket).gap, splat(best + kRounding));
            for (; deeper; deeper &= deeper - 1)
                best = std::min(best, leafGap(tool, placed, obstacle,
                                              entry->bucket * SphereTree::kBranching + std::countr_zero(deeper), X_OT));
        }
    });
    return best;
}

}  // namespace touchstone
