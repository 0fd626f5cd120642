#include "haptics/collision/clearance.hpp"

#include <algorithm>
#include <array>

#include "haptics/collision/tree_walk.hpp"
#include "haptics/math/simd.hpp"

namespace touchstone {
namespace {

using namespace simd;

/// Depth first, nearest children first; a pair of blocks is left out when its lower bound is no less than the best gap
/// so far.
class Search {
  public:
    Search(const SphereTree& tool, const SphereTree& obstacle, const Pose& X_OT, double atMost)
        : tool_(tool),
          obstacle_(obstacle),
          X_OT_(X_OT),
          R_(X_OT.R()),
          guard_(floatGuard(tool, obstacle, X_OT)),
          best_(atMost) {}

    double run() {
        const int a = int(tool_.levels.size()) - 1, b = int(obstacle_.levels.size()) - 1;
        const Sphere t = tool_.block(a, 0), o = obstacle_.block(b, 0);
        if ((place(t) - Vec3(o.x, o.y, o.z)).norm() - t.r - o.r < best_) descend(a, 0, b, 0);
        return best_;
    }

  private:
    Vec3 place(const Sphere& s) const { return R_ * Vec3(s.x, s.y, s.z) + X_OT_.p; }

    void descend(int a, int i, int b, int j) {
        if (a == 0 && b == 0) {
            const Sphere t = tool_.leaf(i), o = obstacle_.leaf(j);
            best_ = std::min(best_,
                             (X_OT_ * Vec3(t.x, t.y, t.z) - Vec3(o.x, o.y, o.z)).norm() - (double(t.r) + double(o.r)));
            return;
        }
        const bool descendObstacle = a == 0 || (b > 0 && obstacle_.levels[b].r[j] >= tool_.levels[a].r[i]);
        const int children = (descendObstacle ? j : i) * SphereTree::kBranching;
        const Float8 bound = descendObstacle ? boundsToObstacle(tool_.block(a, i), obstacle_.levels[b - 1], children)
                                             : boundsToTool(tool_.levels[a - 1], children, obstacle_.block(b, j));
        std::array<int, 8> order{0, 1, 2, 3, 4, 5, 6, 7};
        std::sort(order.begin(), order.end(), [&](int u, int v) { return bound[u] < bound[v]; });
        for (const int k : order) {
            if (double(bound[k]) >= best_) break;
            if (descendObstacle)
                descend(a, i, b - 1, children + k);
            else
                descend(a - 1, children + k, b, j);
        }
    }

    /// Gap of the bounding spheres: no leaf gap below is smaller.
    Float8 boundsToObstacle(const Sphere& tool, const TreeLevel& level, int first) const {
        const Vec3 c = place(tool);
        const Float8 dx = load(&level.x[first]) - splat(float(c.x())), dy = load(&level.y[first]) - splat(float(c.y())),
                     dz = load(&level.z[first]) - splat(float(c.z()));
        return simd::sqrt(dx * dx + dy * dy + dz * dz) - (load(&level.r[first]) + splat(tool.r + guard_));
    }

    Float8 boundsToTool(const TreeLevel& level, int first, const Sphere& obstacle) const {
        // The other way round: the obstacle's centre in the tool's frame.
        const Vec3 c = R_.transpose() * (Vec3(obstacle.x, obstacle.y, obstacle.z) - X_OT_.p);
        const Float8 dx = load(&level.x[first]) - splat(float(c.x())), dy = load(&level.y[first]) - splat(float(c.y())),
                     dz = load(&level.z[first]) - splat(float(c.z()));
        return simd::sqrt(dx * dx + dy * dy + dz * dz) - (load(&level.r[first]) + splat(obstacle.r + guard_));
    }

    const SphereTree& tool_;
    const SphereTree& obstacle_;
    const Pose& X_OT_;
    const Mat3 R_;
    const float guard_;
    double best_;
};

}  // namespace

double leastGap(const SphereTree& tool, const SphereTree& obstacle, const Pose& X_OT, double atMost) {
    return Search(tool, obstacle, X_OT, atMost).run();
}

}  // namespace touchstone
