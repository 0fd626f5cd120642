#include "haptics/surface/surface_overlap.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <tuple>

#include "haptics/surface/surface_distance.hpp"

namespace touchstone {

using namespace simd;
using Eigen::Vector3f;

namespace {

/// Size of the stack of a walk. Each step takes one pair and adds at most 64, in trees of at most nine levels.
constexpr int kStack = 64 * 20;
/// Directions of the rays that count crossings; an odd number, so that one of them may meet an edge.
const std::array<Vec3, 3> kRays{Vec3(0.5411, 0.2743, 0.7949), Vec3(-0.3127, 0.8861, 0.3419),
                                Vec3(0.7283, -0.5917, -0.3455)};

double volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) { return (b - a).cross(c - a).dot(d - a); }

bool facesIntersect(const Surface& tool, const Surface& obstacle, const Pose& X_OT) {
    if (tool.faces.count() == 0 || obstacle.faces.count() == 0) return false;
    const auto &ours = tool.faces.nodes(), &others = obstacle.faces.nodes();
    const BoxPlacement boxes = placementOf(tool, obstacle, X_OT);
    const auto meets = [](const FeatureTree::Node& node, const float* lo, const float* hi) {
        return toMask((node.lo[0] <= splat(hi[0])) & (node.hi[0] >= splat(lo[0])) & (node.lo[1] <= splat(hi[1])) &
                      (node.hi[1] >= splat(lo[1])) & (node.lo[2] <= splat(hi[2])) & (node.hi[2] >= splat(lo[2])));
    };
    std::array<PairEntry, kStack> stack;
    int waiting = 0;
    stack[std::size_t(waiting++)] = {0, 0};
    while (waiting > 0) {
        const PairEntry top = stack[std::size_t(--waiting)];
        const FeatureTree::Node &a = ours[std::size_t(top.tool)], &b = others[std::size_t(top.obstacle)];
        if (a.isLeaf && !b.isLeaf) {
            float lo[3], hi[3];
            boxes.place(a.own.lo.data(), a.own.hi.data(), lo, hi);
            for (Mask mask = meets(b, lo, hi); mask; mask &= mask - 1)
                stack[std::size_t(waiting++)] = {top.tool, b.first + std::countr_zero(mask)};
            continue;
        }
        Float8 lo[3], hi[3];
        boxes.place(a.lo, a.hi, lo, hi);
        for (int i = 0; i < a.count; ++i) {
            const float l[3] = {lo[0][i], lo[1][i], lo[2][i]}, h[3] = {hi[0][i], hi[1][i], hi[2][i]};
            if (b.isLeaf && !a.isLeaf) {
                bool apart = false;
                for (int k = 0; k < 3; ++k) apart = apart || l[k] > b.own.hi[k] || h[k] < b.own.lo[k];
                if (!apart) stack[std::size_t(waiting++)] = {a.first + i, top.obstacle};
                continue;
            }
            Triangle placed;
            bool isPlaced = false;
            for (Mask mask = meets(b, l, h); mask; mask &= mask - 1) {
                const int j = b.first + std::countr_zero(mask);
                if (!a.isLeaf) {
                    stack[std::size_t(waiting++)] = {a.first + i, j};
                    continue;
                }
                if (!isPlaced) {
                    placed = tool.features.triangle(a.first + i);
                    for (Vec3& p : placed) p = X_OT * p;
                    isPlaced = true;
                }
                if (commonPoint(placed, obstacle.features.triangle(j))) return true;
            }
        }
    }
    return false;
}

/// Number of faces that the ray leaves through, less those that it enters through.
int crossings(const Surface& surface, const Vec3& from, const Vec3& direction) {
    const auto& nodes = surface.faces.nodes();
    const Vec3 to = from + 4 * (surface.extent.reach + (from - surface.extent.center).norm() + 1) * direction;
    const Vector3f start = (from - surface.extent.center).cast<float>();
    Float8 origin[3], inverse[3];
    for (int k = 0; k < 3; ++k) origin[k] = splat(start[k]), inverse[k] = splat(float(1 / direction[k]));
    const float guard = float(16 * 0x1p-24 * ((from - surface.extent.center).norm() + surface.extent.reach) + 1e-7);
    std::array<std::int32_t, kStack> stack;
    int waiting = 0, count = 0;
    stack[std::size_t(waiting++)] = 0;
    while (waiting > 0) {
        const FeatureTree::Node& node = nodes[std::size_t(stack[std::size_t(--waiting)])];
        Float8 enter = splat(0.0f), leave = splat(HUGE_VALF);
        for (int k = 0; k < 3; ++k) {
            const Float8 a = (node.lo[k] - guard - origin[k]) * inverse[k],
                         b = (node.hi[k] + guard - origin[k]) * inverse[k];
            enter = max(enter, a < b ? a : b);
            const Float8 last = a < b ? b : a;
            leave = leave < last ? leave : last;
        }
        Mask mask = toMask(enter <= leave * 1.0001f) & ((1u << node.count) - 1);
        for (; mask; mask &= mask - 1) {
            const int child = node.first + std::countr_zero(mask);
            if (!node.isLeaf)
                stack[std::size_t(waiting++)] = child;
            else if (const Triangle t = surface.features.triangle(child); piercing(from, to, t))
                count += surface.features.faces[child].normal.dot(direction) > 0 ? 1 : -1;
        }
    }
    return count;
}

/// Branch and bound over the faces of a part that is partly inside another: the depth of a point changes by no more
/// than the point moves, so a box holds nothing deeper than its center by more than its radius.
struct DepthSearch {
    const Surface &inner, &outer;
    const Pose& X;  ///< of the inner part in the outer one's frame
    double deepest;

    double run() {
        descend(0);
        return deepest;
    }
    void test(const Vec3& point) {
        const double distance = distanceTo(outer, point);
        if (distance > deepest && isInside(outer, point)) deepest = distance;
    }
    void test(const Triangle& face) {
        for (int k = 0; k < 3; ++k) {
            const Vec3 a = X * face[k], b = X * face[(k + 1) % 3];
            test(a);
            // Of an edge that passes through, the middle of the first way in and the last way out.
            const auto in = firstHit(outer, a, b - a), out = firstHit(outer, b, a - b);
            const double length = (b - a).norm();
            if (in && out && (*in - a).norm() < length && (*out - b).norm() < length) test((*in + *out) / 2);
        }
    }
    void descend(int i) {
        const FeatureTree::Node& node = inner.faces.nodes()[std::size_t(i)];
        std::array<std::pair<double, int>, 8> order;
        for (int lane = 0; lane < node.count; ++lane) {
            Vec3 lo, hi;
            for (int k = 0; k < 3; ++k) lo[k] = node.lo[k][lane], hi[k] = node.hi[k][lane];
            const Vec3 center = X * (inner.extent.center + (lo + hi) / 2);
            const double distance = distanceTo(outer, center), radius = (hi - lo).norm() / 2;
            const bool open = distance + radius > deepest;
            order[std::size_t(lane)] = {(open && isInside(outer, center) ? distance : -distance) + radius, lane};
        }
        std::sort(order.begin(), order.begin() + node.count, std::greater<>());
        for (int n = 0; n < node.count && order[std::size_t(n)].first > deepest; ++n) {
            const int child = node.first + order[std::size_t(n)].second;
            if (node.isLeaf)
                test(inner.features.triangle(child));
            else
                descend(child);
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
    if (surface.faces.count() == 0 || (point - surface.extent.center).norm() > surface.extent.reach) return false;
    int votes = 0;
    for (const Vec3& ray : kRays) votes += crossings(surface, point, ray.normalized()) > 0 ? 1 : -1;
    return votes > 0;
}

double overlapDepth(const Surface& tool, const Surface& obstacle, const Pose& X_OT) {
    double deepest = 0;
    for (const auto& [inner, outer, X] :
         {std::tuple(&tool, &obstacle, X_OT), std::tuple(&obstacle, &tool, X_OT.inverse())})
        if (inner->faces.count() > 0) deepest = DepthSearch{*inner, *outer, X, deepest}.run();
    return deepest;
}

bool overlap(const Surface& tool, const Surface& obstacle, const Pose& X_OT) {
    if (facesIntersect(tool, obstacle, X_OT)) return true;
    // Surfaces that do not intersect: a part is inside the other with all of a shell, or outside.
    const auto anyShellInside = [](const Surface& inner, const Surface& outer, const Pose& X) {
        for (const int point : inner.shells)
            if (isInside(outer, X * inner.features.points[point])) return true;
        return false;
    };
    return anyShellInside(tool, obstacle, X_OT) || anyShellInside(obstacle, tool, X_OT.inverse());
}

}  // namespace touchstone
