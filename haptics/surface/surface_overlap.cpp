#include "haptics/surface/surface_overlap.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <tuple>

#include "haptics/surface/feature_lanes.hpp"
#include "haptics/surface/surface_distance.hpp"

namespace touchstone {

using namespace simd;
using Eigen::Vector3f;

namespace {

/// Directions of the rays that count crossings; an odd number, so that one of them may meet an edge.
const std::array<Vec3, 3> kRays{Vec3(0.5411, 0.2743, 0.7949), Vec3(-0.3127, 0.8861, 0.3419),
                                Vec3(0.7283, -0.5917, -0.3455)};

double volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) { return (b - a).cross(c - a).dot(d - a); }

/// Whether any two faces below two nodes intersect.
class FaceIntersection {
  public:
    FaceIntersection(const Surface& tool, const Surface& obstacle, const Pose& X_OT)
        : tool_(tool), obstacle_(obstacle), X_OT_(X_OT), boxes_(placementOf(tool, obstacle, X_OT)) {}

    bool run() const {
        return !tool_.tree.empty() && !obstacle_.tree.empty() &&
               descend(tool_.tree.height(), 0, obstacle_.tree.height(), 0);
    }

  private:
    static constexpr int kChildren = FeatureTree::kChildren;

    static Mask meeting(const Float8 lo[3], const Float8 hi[3], const float* otherLo, const float* otherHi) {
        Int8 meets = splat(-1);
        for (int k = 0; k < 3; ++k) meets &= (lo[k] <= splat(otherHi[k])) & (hi[k] >= splat(otherLo[k]));
        return toMask(meets);
    }

    bool descend(int height, int i, int otherHeight, int j) const {
        if (height == 0 && otherHeight == 0) return patchesIntersect(i, j);
        if (height >= otherHeight) {
            const FeatureTree::Bounds8& children = tool_.tree.children(FeatureKind::Face, height, i);
            const FeatureBounds other = obstacle_.tree.bounds(FeatureKind::Face, otherHeight, j);
            Float8 lo[3], hi[3];
            boxes_.place(children.lo, children.hi, lo, hi);
            for (Mask mask = meeting(lo, hi, other.lo.data(), other.hi.data()); mask; mask &= mask - 1)
                if (descend(height - 1, kChildren * i + std::countr_zero(mask), otherHeight, j)) return true;
            return false;
        }
        const FeatureTree::Bounds8& children = obstacle_.tree.children(FeatureKind::Face, otherHeight, j);
        const FeatureBounds own = tool_.tree.bounds(FeatureKind::Face, height, i);
        float lo[3], hi[3];
        boxes_.place(own.lo.data(), own.hi.data(), lo, hi);
        for (Mask mask = meeting(children.lo, children.hi, lo, hi); mask; mask &= mask - 1)
            if (descend(height, i, otherHeight - 1, kChildren * j + std::countr_zero(mask))) return true;
        return false;
    }

    bool patchesIntersect(int i, int j) const {
        const FeatureBounds patch = obstacle_.tree.bounds(FeatureKind::Face, 0, j);
        const FaceLanes turned = boxes_.R * FaceLanes(Eight(tool_.faces, kChildren * i));
        const Vec8 t(boxes_.t), guard = Vector3f(Vector3f::Constant(boxes_.guard));
        const FaceLanes ours(turned.a + t, turned.b + t, turned.c + t, turned.normal);
        const Box8 exact = ours.box(), boxes{exact.lo - guard, exact.hi + guard};
        Mask near = boxes.meets({patch.lo, patch.hi}) & first(tool_.facesOf(i));
        if (!near) return false;
        const FaceLanes theirs(Eight(obstacle_.faces, kChildren * j));
        const Box8 theirBoxes = theirs.box();
        const Mask all = first(obstacle_.facesOf(j));
        for (; near; near &= near - 1) {
            const int lane = std::countr_zero(near);
            Mask mask = theirBoxes.meets(boxes.all(lane)) & all;
            if (!mask) continue;
            // A face on one side of the other's plane does not intersect it.
            const Vec8 a = ours.a.all(lane), b = ours.b.all(lane), c = ours.c.all(lane), normal = ours.normal.all(lane);
            mask &= onBothSides(dot(theirs.normal, a - theirs.a), dot(theirs.normal, b - theirs.a),
                                dot(theirs.normal, c - theirs.a));
            mask &= onBothSides(dot(normal, theirs.a - a), dot(normal, theirs.b - a), dot(normal, theirs.c - a));
            if (!mask) continue;
            Triangle placed = tool_.features.triangle(kChildren * i + lane);
            for (Vec3& p : placed) p = X_OT_ * p;
            for (; mask; mask &= mask - 1)
                if (commonPoint(placed, obstacle_.features.triangle(kChildren * j + std::countr_zero(mask))))
                    return true;
        }
        return false;
    }

    static Mask first(int count) { return (1u << count) - 1; }
    /// Those of eight faces whose corners have these heights above a plane and may meet it.
    Mask onBothSides(const Float8& a, const Float8& b, const Float8& c) const {
        const Float8 most = max(max(a, b), c), least = min(min(a, b), c);
        return toMask((most >= -boxes_.guard) & (least <= boxes_.guard));
    }

    const Surface& tool_;
    const Surface& obstacle_;
    const Pose& X_OT_;
    const BoxPlacement boxes_;
};

/// Pieces along its longest side that a face is cut to, in the search for its deepest point.
constexpr double kPieces = 16;
/// How much deeper than vertices and edges a point inside a face must be to be looked for: the search takes its time.
constexpr double kDeeper = 1.1;

/// How far below its face a point is taken that tells whether a shell is inside another part, in reaches of its part:
/// far above rounding, far below a wall.
constexpr double kBelowFace = 1e-7;

/// Number of faces below a node that a ray leaves through, less those that it enters through.
struct CrossingCount {
    const Surface& surface;
    Vec3 from, to;
    Float8 origin[3], inverse[3];
    float guard;
    int count = 0;

    CrossingCount(const Surface& surface_, const Vec3& from_, const Vec3& direction)
        : surface(surface_),
          from(from_),
          to(from + 4 * (surface.extent.reach + (from - surface.extent.center).norm() + 1) * direction),
          guard(float(16 * 0x1p-24 * ((from - surface.extent.center).norm() + surface.extent.reach) + 1e-7)) {
        const Vector3f start = (from - surface.extent.center).cast<float>();
        for (int k = 0; k < 3; ++k) origin[k] = splat(start[k]), inverse[k] = splat(float(1 / direction[k]));
        descend(surface.tree.height(), 0);
    }

    void descend(int height, int i) {
        Float8 lo[3], hi[3], enter = splat(0.0f), leave = splat(HUGE_VALF);
        const int lanes = surface.boxesBelow(height, i, lo, hi);
        for (int k = 0; k < 3; ++k) {
            const Float8 a = (lo[k] - guard - origin[k]) * inverse[k], b = (hi[k] + guard - origin[k]) * inverse[k];
            enter = max(enter, a < b ? a : b);
            const Float8 last = a < b ? b : a;
            leave = leave < last ? leave : last;
        }
        for (Mask mask = toMask(enter <= leave * 1.0001f) & ((1u << lanes) - 1); mask; mask &= mask - 1) {
            const int child = FeatureTree::kChildren * i + std::countr_zero(mask);
            if (height > 0)
                descend(height - 1, child);
            else if (piercing(from, to, surface.features.triangle(child)))
                count += surface.features.faces[child].normal.dot(to - from) > 0 ? 1 : -1;
        }
    }
};

/// Branch and bound over the faces of a part that is partly inside another: the depth of a point changes by no more
/// than the point moves, so a box holds nothing deeper than its center by more than its radius.
struct DepthSearch {
    const Surface &inner, &outer;
    const Pose& X;  ///< of the inner part in the outer one's frame
    double deepest;
    bool middles;              ///< points inside faces, instead of vertices and edges
    double enough = HUGE_VAL;  ///< nothing deeper is looked for

    /// Whether it is worth to look below a node or in a face whose points are at most this deep.
    bool open(double bound) const { return deepest <= enough && bound > (middles ? kDeeper : 1) * deepest; }
    double run() {
        descend(inner.tree.height(), 0);
        return deepest;
    }
    void test(const Vec3& point) {
        const double distance = distanceTo(outer, point);
        if (distance > deepest && isInside(outer, point)) deepest = distance;
    }
    void test(const Triangle& face) {
        const Triangle placed{X * face[0], X * face[1], X * face[2]};
        if (middles) return testMiddle(placed, longest(placed).second / kPieces);
        for (int k = 0; k < 3; ++k) {
            const Vec3 &a = placed[k], &b = placed[(k + 1) % 3];
            test(a);
            // For an edge that passes through: the middle of the first way in and the last way out.
            const auto in = firstHit(outer, a, b - a), out = firstHit(outer, b, a - b);
            const double length = (b - a).norm();
            if (in && out && (*in - a).norm() < length && (*out - b).norm() < length) test((*in + *out) / 2);
        }
    }
    /// Index and length of the longest side, which is opposite the vertex of that index.
    static std::pair<int, double> longest(const Triangle& face) {
        std::pair<int, double> found{0, 0};
        for (int k = 0; k < 3; ++k)
            if (const double length = (face[(k + 2) % 3] - face[(k + 1) % 3]).norm(); length > found.second)
                found = {k, length};
        return found;
    }
    /// For a face whose border is nowhere deep: one that passes through flush with others, or is larger than the
    /// overlap. Halves it along its longest side, until that is no longer than `least`.
    void testMiddle(const Triangle& face, double least) {
        const Vec3 center = (face[0] + face[1] + face[2]) / 3;
        double radius = 0;
        for (const Vec3& p : face) radius = std::max(radius, (p - center).norm());
        const double distance = distanceTo(outer, center);
        if (!open(distance + radius)) return;
        const double depth = isInside(outer, center) ? distance : -distance;
        deepest = std::max(deepest, depth);
        if (!open(depth + radius)) return;
        const auto [k, length] = longest(face);
        if (length <= least) return;
        const Vec3 middle = (face[(k + 1) % 3] + face[(k + 2) % 3]) / 2;
        testMiddle({face[k], face[(k + 1) % 3], middle}, least);
        testMiddle({face[k], middle, face[(k + 2) % 3]}, least);
    }
    void descend(int height, int i) {
        Float8 low[3], high[3];
        const int lanes = inner.boxesBelow(height, i, low, high);
        std::array<std::pair<double, int>, FeatureTree::kChildren> order;
        for (int lane = 0; lane < lanes; ++lane) {
            Vec3 lo, hi;
            for (int k = 0; k < 3; ++k) lo[k] = low[k][lane], hi[k] = high[k][lane];
            const Vec3 center = X * (inner.extent.center + (lo + hi) / 2);
            const double distance = distanceTo(outer, center), radius = (hi - lo).norm() / 2;
            const bool inside = open(distance + radius) && isInside(outer, center);
            order[std::size_t(lane)] = {(inside ? distance : -distance) + radius, lane};
        }
        std::sort(order.begin(), order.begin() + lanes, std::greater<>());
        for (int n = 0; n < lanes && open(order[std::size_t(n)].first); ++n) {
            const int child = FeatureTree::kChildren * i + order[std::size_t(n)].second;
            if (height > 0)
                descend(height - 1, child);
            else
                test(inner.features.triangle(child));
        }
    }
};

}  // namespace

std::optional<Vec3> piercing(const Vec3& a, const Vec3& b, const Triangle& t) {
    const double from = volume(t[0], t[1], t[2], a), to = volume(t[0], t[1], t[2], b);
    if ((from > 0) == (to > 0)) return std::nullopt;
    const bool first = volume(a, b, t[0], t[1]) > 0;
    if ((volume(a, b, t[1], t[2]) > 0) != first || (volume(a, b, t[2], t[0]) > 0) != first) return std::nullopt;
    return a + from / (from - to) * (b - a);
}

std::optional<Vec3> commonPoint(const Triangle& a, const Triangle& b) {
    for (int k = 0; k < 3; ++k) {
        if (const auto at = piercing(a[k], a[(k + 1) % 3], b)) return at;
        if (const auto at = piercing(b[k], b[(k + 1) % 3], a)) return at;
    }
    return std::nullopt;
}

bool isInside(const Surface& surface, const Vec3& point) {
    if (surface.tree.empty() || (point - surface.extent.center).norm() > surface.extent.reach) return false;
    int votes = 0;
    for (const Vec3& ray : kRays) votes += CrossingCount(surface, point, ray.normalized()).count > 0 ? 1 : -1;
    return votes > 0;
}

namespace {

/// The depth if it is greater than `deepest`, or one that is greater than `enough`.
double searchDepth(const Surface& tool, const Surface& obstacle, const Pose& X_OT, bool insideFaces, double deepest,
                   double enough) {
    for (const bool middles : {false, true}) {  // few faces can have points deeper than the deepest vertex
        if (middles && !insideFaces) break;
        for (const auto& [inner, outer, X] :
             {std::tuple(&tool, &obstacle, X_OT), std::tuple(&obstacle, &tool, X_OT.inverse())})
            if (!inner->tree.empty()) deepest = DepthSearch{*inner, *outer, X, deepest, middles, enough}.run();
    }
    return deepest;
}

}  // namespace

double overlapDepth(const Surface& tool, const Surface& obstacle, const Pose& X_OT, bool insideFaces) {
    return searchDepth(tool, obstacle, X_OT, insideFaces, 0, HUGE_VAL);
}

bool overlapsDeeper(const Surface& tool, const Surface& obstacle, const Pose& X_OT, double depth, bool insideFaces) {
    return overlap(tool, obstacle, X_OT) && searchDepth(tool, obstacle, X_OT, insideFaces, depth, depth) > depth;
}

bool overlap(const Surface& tool, const Surface& obstacle, const Pose& X_OT) {
    if (FaceIntersection(tool, obstacle, X_OT).run()) return true;
    // Surfaces that do not intersect: a part is inside the other with all of a shell, or outside. A point just below a
    // face says so also where all faces lie on the other's.
    const auto anyShellInside = [](const Surface& inner, const Surface& outer, const Pose& X) {
        for (const int f : inner.shells) {
            const Triangle face = inner.features.triangle(f);
            const Vec3 middle = (face[0] + face[1] + face[2]) / 3;
            const Vec3 below = kBelowFace * inner.extent.reach * inner.features.faces[f].normal;
            if (isInside(outer, X * (middle - below))) return true;
        }
        return false;
    };
    return anyShellInside(tool, obstacle, X_OT) || anyShellInside(obstacle, tool, X_OT.inverse());
}

}  // namespace touchstone
