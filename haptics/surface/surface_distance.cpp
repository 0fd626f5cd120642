#include "haptics/surface/surface_distance.hpp"

#include <array>
#include <bit>
#include <cmath>

#include "haptics/surface/surface_overlap.hpp"

namespace touchstone {

using namespace simd;

namespace {

NearestPoints nearestOf(const Triangle& tool, const Triangle& obstacle) {
    NearestPoints best;
    double least = HUGE_VAL;
    const auto offer = [&](const Vec3& onTool, const Vec3& onObstacle) {
        const double distance2 = (onTool - onObstacle).squaredNorm();
        if (distance2 >= least) return;
        least = distance2;
        best = {onTool, onObstacle};
    };
    for (int k = 0; k < 3; ++k) {
        offer(tool[k], closestPoint(tool[k], obstacle, false));
        offer(closestPoint(obstacle[k], tool, false), obstacle[k]);
        for (int i = 0; i < 3; ++i) {
            const Vec3 &a = tool[k], &b = obstacle[i], u = tool[(k + 1) % 3] - a, v = obstacle[(i + 1) % 3] - b;
            const auto [s, t] = nearestFractions<Vec3>(u, v, a - b);
            offer(a + s * u, b + t * v);
        }
    }
    if (const auto common = commonPoint(tool, obstacle)) best = {*common, *common};
    return best;
}

/// The lanes with a bound below a limit, in ascending order of their bounds.
struct Nearer {
    std::array<int, 8> lanes;
    int count = 0;

    Nearer(const Float8& bound, int lanesUsed, float limit) {
        for (Mask open = lessEqual(bound, splat(limit)) & ((1u << lanesUsed) - 1); open; open &= open - 1) {
            const int lane = std::countr_zero(open);
            int at = count++;
            for (; at > 0 && bound[lanes[std::size_t(at - 1)]] > bound[lane]; --at)
                lanes[std::size_t(at)] = lanes[std::size_t(at - 1)];
            lanes[std::size_t(at)] = lane;
        }
    }
};

/// Lower bounds on the squared distance of a box from eight.
Float8 distance2(const Float8 lo[3], const Float8 hi[3], const float otherLo[3], const float otherHi[3]) {
    Float8 sum = splat(0.0f);
    for (int k = 0; k < 3; ++k) {
        const Float8 outside = apart(lo[k], hi[k], splat(otherLo[k]), splat(otherHi[k]));
        sum = fma(outside, outside, sum);
    }
    return sum;
}

/// Branch and bound over two trees of faces, nearest boxes first.
class SurfaceSearch {
  public:
    SurfaceSearch(const Surface& tool, const Surface& obstacle, const Pose& X_OT, double atMost)
        : tool_(tool), obstacle_(obstacle), X_OT_(X_OT), boxes_(placementOf(tool, obstacle, X_OT)), best_(atMost) {}

    void test(int face, int other) {
        Triangle placed = tool_.features.triangle(face);
        for (Vec3& p : placed) p = X_OT_ * p;
        const NearestPoints found = nearestOf(placed, obstacle_.features.triangle(other));
        if (!(found.distance() < best_)) return;
        best_ = found.distance();
        found_ = found;
        pair_ = {face, other};
    }

    void run() { descend(tool_.tree.height(), 0, obstacle_.tree.height(), 0); }

    const std::optional<NearestPoints>& found() const { return found_; }
    FacePair pair() const { return pair_; }

  private:
    /// Two nodes, of which the larger one is split, or the faces of two patches.
    void descend(int height, int i, int otherHeight, int j) {
        const FeatureBounds a = tool_.tree.bounds(FeatureKind::Face, height, i),
                            b = obstacle_.tree.bounds(FeatureKind::Face, otherHeight, j);
        const auto sizeOf = [](const FeatureBounds& box) { return (box.hi - box.lo).squaredNorm(); };
        Float8 lo[3], hi[3];
        if (height == 0 && otherHeight == 0) {
            Float8 theirLo[3], theirHi[3], ourLo[3], ourHi[3];
            tool_.faceBoxes(i, ourLo, ourHi);
            obstacle_.faceBoxes(j, theirLo, theirHi);
            boxes_.place(ourLo, ourHi, lo, hi);
            const Nearer order(distance2(lo, hi, b.lo.data(), b.hi.data()), tool_.facesOf(i), limit2());
            for (int n = 0; n < order.count; ++n) {
                const int lane = order.lanes[std::size_t(n)];
                const float l[3] = {lo[0][lane], lo[1][lane], lo[2][lane]},
                            h[3] = {hi[0][lane], hi[1][lane], hi[2][lane]};
                const Nearer others(distance2(theirLo, theirHi, l, h), obstacle_.facesOf(j), limit2());
                for (int m = 0; m < others.count; ++m)
                    test(FeatureTree::kChildren * i + lane, FeatureTree::kChildren * j + others.lanes[std::size_t(m)]);
            }
        } else if (otherHeight == 0 || (height > 0 && sizeOf(a) > sizeOf(b))) {
            const FeatureTree::Bounds8& children = tool_.tree.children(FeatureKind::Face, height, i);
            boxes_.place(children.lo, children.hi, lo, hi);
            const Nearer order(distance2(lo, hi, b.lo.data(), b.hi.data()), tool_.tree.childCount(height, i), limit2());
            for (int n = 0; n < order.count; ++n)
                descend(height - 1, FeatureTree::kChildren * i + order.lanes[std::size_t(n)], otherHeight, j);
        } else {
            const FeatureTree::Bounds8& children = obstacle_.tree.children(FeatureKind::Face, otherHeight, j);
            float l[3], h[3];
            boxes_.place(a.lo.data(), a.hi.data(), l, h);
            const Nearer order(distance2(children.lo, children.hi, l, h), obstacle_.tree.childCount(otherHeight, j),
                               limit2());
            for (int n = 0; n < order.count; ++n)
                descend(height, i, otherHeight - 1, FeatureTree::kChildren * j + order.lanes[std::size_t(n)]);
        }
    }

    /// Boxes beyond it hold nothing nearer; rounded up.
    float limit2() const { return best_ < 1e15 ? float(best_ * best_) * 1.00001f : HUGE_VALF; }

    const Surface& tool_;
    const Surface& obstacle_;
    const Pose& X_OT_;
    const BoxPlacement boxes_;
    double best_;
    std::optional<NearestPoints> found_;
    FacePair pair_;
};

struct PointSearch {
    const Surface& surface;
    const Vec3& point;
    Eigen::Vector3f p;
    float guard;
    double best;

    void descend(int height, int i) {
        Float8 lo[3], hi[3];
        const int lanes = surface.boxesBelow(height, i, lo, hi);
        Float8 bound = splat(0.0f);
        for (int k = 0; k < 3; ++k) {
            const Float8 outside = apart(splat(p[k] - guard), splat(p[k] + guard), lo[k], hi[k]);
            bound += outside * outside;
        }
        const auto limit2 = [&] { return best < 1e15 ? float(best * best) * 1.00001f : HUGE_VALF; };
        const Nearer order(bound, lanes, limit2());
        for (int n = 0; n < order.count; ++n) {
            const int lane = order.lanes[std::size_t(n)], child = FeatureTree::kChildren * i + lane;
            if (bound[lane] > limit2()) return;
            if (height > 0)
                descend(height - 1, child);
            else
                best = std::min(best, (closestPoint(point, surface.features.triangle(child), false) - point).norm());
        }
    }
};

/// Descends into the boxes on a segment, those that it enters first first.
class RaySearch {
  public:
    RaySearch(const Surface& surface, const Vec3& from, const Vec3& to)
        : surface_(surface),
          from_(from),
          to_(to),
          p_((from - surface.extent.center).cast<float>()),
          guard_(float(16 * 0x1p-24 * ((from - surface.extent.center).norm() + surface.extent.reach))) {
        for (int k = 0; k < 3; ++k) {
            const double span = to[k] - from[k];
            inverse_[k] = float(1 / (std::abs(span) > 1e-12 ? span : 1e-12));
        }
    }

    void descend(int height, int i) {
        Float8 lo[3], hi[3];
        const int lanes = surface_.boxesBelow(height, i, lo, hi);
        Float8 enter = splat(0.0f), leave = splat(1.0f);
        for (int k = 0; k < 3; ++k) {
            const Float8 a = (lo[k] - guard_ - p_[k]) * inverse_[k], b = (hi[k] + guard_ - p_[k]) * inverse_[k],
                         first = a < b ? a : b, last = a < b ? b : a;
            enter = max(enter, first);
            leave = leave < last ? leave : last;
        }
        const Nearer order(enter <= leave + 1e-6f ? enter : splat(HUGE_VALF), lanes, float(best_));
        for (int n = 0; n < order.count; ++n) {
            const int lane = order.lanes[std::size_t(n)], child = FeatureTree::kChildren * i + lane;
            if (enter[lane] > float(best_) + 1e-6f) return;
            if (height > 0) {
                descend(height - 1, child);
            } else if (const auto at = piercing(from_, to_, surface_.features.triangle(child))) {
                const double share = (*at - from_).norm() / (to_ - from_).norm();
                if (share < best_) best_ = share, hit_ = at;
            }
        }
    }

    const std::optional<Vec3>& hit() const { return hit_; }

  private:
    const Surface& surface_;
    const Vec3 from_, to_;
    const Eigen::Vector3f p_;
    const float guard_;
    float inverse_[3];
    double best_ = 1;  ///< fraction of the segment up to the hit
    std::optional<Vec3> hit_;
};

}  // namespace

std::optional<NearestPoints> nearestPoints(const Surface& tool, const Surface& obstacle, const Pose& X_OT,
                                           double atMost, FacePair* nearest) {
    if (tool.tree.empty() || obstacle.tree.empty()) return std::nullopt;
    SurfaceSearch search(tool, obstacle, X_OT, atMost);
    if (nearest) search.test(nearest->tool, nearest->obstacle);
    search.run();
    if (nearest && search.found()) *nearest = search.pair();
    return search.found();
}

double distanceTo(const Surface& surface, const Vec3& point, double atMost) {
    if (surface.tree.empty()) return atMost;
    const Vec3 p = point - surface.extent.center;
    PointSearch search{surface, point, p.cast<float>(), float(4 * 0x1p-24 * (p.norm() + surface.extent.reach)), atMost};
    search.descend(surface.tree.height(), 0);
    return search.best;
}

std::optional<Vec3> firstHit(const Surface& surface, const Vec3& from, const Vec3& direction) {
    if (surface.tree.empty()) return std::nullopt;
    const double length = 2 * (surface.extent.reach + (from - surface.extent.center).norm()) + 1;
    RaySearch search(surface, from, from + length * direction.normalized());
    search.descend(surface.tree.height(), 0);
    return search.hit();
}

}  // namespace touchstone
