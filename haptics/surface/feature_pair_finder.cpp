#include "haptics/surface/feature_pair_finder.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace touchstone {

using namespace simd;
using Eigen::Matrix3f;
using Eigen::Vector3f;

namespace {

constexpr float kPi = std::numbers::pi_v<float>;
/// Maximum number of poses on a course at which a pair is measured, and the length of the way between two of them, mm.
/// Between two poses the gap may be smaller by half the way, so more poses keep fewer pairs and take more time.
constexpr int kSamples = 6;
constexpr float kSampleWay = 0.1f;
/// Added to angles, rad: more than the rounding of directions in float.
constexpr double kAngleGuard = 1e-4;

/// Of a point and a triangle. Source: C. Ericson, Real-Time Collision Detection (2005), 5.1.5.
template <class V, class Real = typename V::Scalar>
Real distance2(const V& p, const V& a, const V& b, const V& c) {
    const V ab = b - a, ac = c - a, ap = p - a;
    const Real d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0 && d2 <= 0) return ap.squaredNorm();
    const V bp = p - b;
    const Real d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0 && d4 <= d3) return bp.squaredNorm();
    const Real vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return (ap - (d1 / (d1 - d3)) * ab).squaredNorm();
    const V cp = p - c;
    const Real d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0 && d5 <= d6) return cp.squaredNorm();
    const Real vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return (ap - (d2 / (d2 - d6)) * ac).squaredNorm();
    const Real va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
        return (bp - ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (c - b)).squaredNorm();
    const V n = ab.cross(ac);
    const Real h = n.dot(ap);
    return h * h / n.squaredNorm();
}

/// Of two segments a + s u and b + t v.
template <class V, class Real = typename V::Scalar>
Real edgeDistance2(const V& a, const V& u, const V& b, const V& v) {
    const V w = a - b;
    const auto [s, t] = nearestFractions<V>(u, v, w);
    return (w + s * u - t * v).squaredNorm();
}

}  // namespace

/// Points in float are relative to the center of their part. `t`: from the obstacle's center to the tool's.
struct FeaturePairFinder::Query {
    const Surface &tool, &obstacle;
    Matrix3f R;
    Vector3f t, shift, turn;
    float margin, angle;  ///< angle: by which normals may differ from being opposite
    float sine;           ///< its sine, at most 1
    bool stays;

    Query(const Surface& tool_, const Surface& obstacle_, const Coverage& asked, float guard, double leastAbout)
        : tool(tool_), obstacle(obstacle_) {
        const Course& course = asked.course;
        R = course.X_OT.R().cast<float>();
        t = (course.X_OT * tool.extent.center - obstacle.extent.center).cast<float>();
        shift = course.shift.cast<float>();
        turn = course.turn.cast<float>();
        stays = course.stays();
        margin = float(asked.within.margin) + guard;
        // What serves this course also serves steps near it: neither end of them has turned further, and the pairs of
        // a step may be off by its own turn (FeatureList).
        const double turned = asked.within.margin / std::max(leastAbout, 1e-9) + course.turn.norm();
        angle = float(std::min(3 * turned + kAngleGuard, std::numbers::pi));
        sine = angle < kPi / 2 ? std::sin(angle) : 1.0f;
    }
    Vector3f placed(int point) const { return R * tool.points[point]; }  ///< about the tool's center
    /// The way of a point of the tool at `arm` from its center.
    Vector3f way(const Vector3f& arm) const { return shift + turn.cross(arm); }

    /// Bounds of a part of the tool, over the course, in the obstacle's axes from its center. T: float or Float8.
    template <class T>
    TOUCHSTONE_INLINE void sweep(const T lo[3], const T hi[3], T outLo[3], T outHi[3]) const {
        T c[3], h[3], at[3], half[3];
        for (int k = 0; k < 3; ++k) c[k] = 0.5f * (lo[k] + hi[k]), h[k] = 0.5f * (hi[k] - lo[k]);
        for (int k = 0; k < 3; ++k) {
            at[k] = R(k, 0) * c[0] + R(k, 1) * c[1] + R(k, 2) * c[2];
            half[k] = std::abs(R(k, 0)) * h[0] + std::abs(R(k, 1)) * h[1] + std::abs(R(k, 2)) * h[2];
        }
        for (int k = 0; k < 3; ++k) {
            outLo[k] = at[k] + (t[k] - margin) - half[k];
            outHi[k] = at[k] + (t[k] + margin) + half[k];
        }
        if (stays) return;
        for (int k = 0; k < 3; ++k) {
            const int i = (k + 1) % 3, j = (k + 2) % 3;
            const T path = shift[k] + (turn[i] * at[j] - turn[j] * at[i]);
            const T grow = std::abs(turn[i]) * half[j] + std::abs(turn[j]) * half[i];
            const T least = path - grow, most = path + grow, zero = path - path;
            outLo[k] += least < zero ? least : zero;
            outHi[k] += most > zero ? most : zero;
        }
    }
};

FeaturePairFinder::FeaturePairFinder(const Surface& tool, const Surface& obstacle)
    : PairFinder(tool.extent, 1),
      tool_(&tool),
      obstacle_(&obstacle),
      leastAbout_(std::min(tool.extent.about.minCoeff(), tool.extent.reach)) {
    const int most = std::max({FeatureTree::stackFor(tool.vertices, obstacle.faces),
                               FeatureTree::stackFor(tool.faces, obstacle.vertices),
                               FeatureTree::stackFor(tool.edges, obstacle.edges)});
    stack_.resize(std::size_t(most));
}

PairEntries FeaturePairFinder::entries() const {
    const auto product = [](int a, int b) { return std::int64_t(a) * b; };
    return PairEntries(product(tool_->vertices.count(), obstacle_->faces.count()) +
                       product(tool_->faces.count(), obstacle_->vertices.count()) +
                       product(tool_->edges.count(), obstacle_->edges.count()));
}

float FeaturePairFinder::guard(const Pose& X_OT) const {
    const double t = (X_OT * tool_->extent.center - obstacle_->extent.center).norm();
    return float(16 * 0x1p-24 * (tool_->extent.reach + obstacle_->extent.reach + t) + 1e-7);
}

namespace {

/// Lower bound on the distance of a pair on its course. `at(s)`: squared distance at the fraction s of the course;
/// `length`: of the way.
template <class At>
float alongCourse(float length, At&& at) {
    const int n = std::clamp(int(std::ceil(length / kSampleWay)), 1, kSamples);
    float least = HUGE_VALF;
    const float half = 0.5f / float(n);
    for (int i = 0; i < n; ++i) {
        least = std::min(least, std::sqrt(at(float(2 * i + 1) * half)) - half * length);
        if (least <= 0) return 0;
    }
    return least;
}

}  // namespace

/// The gap of each kind of pair, infinity if it is not within.
struct FeatureMeasure {
    template <class Q>
    static float vertexFace(const Q& q, int vertex, int face) {
        const SurfaceFeatures::Vertex& v = q.tool.features.vertices[vertex];
        const Vector3f n = q.R.transpose() * q.obstacle.normals[face];
        for (int k = 0; k < v.spokes; ++k)
            if (q.tool.spokes[v.firstSpoke + k].dot(n) < -q.sine) return HUGE_VALF;
        const auto& corners = q.obstacle.features.faces[face].points;
        const Vector3f &a = q.obstacle.points[corners[0]], &b = q.obstacle.points[corners[1]],
                       &c = q.obstacle.points[corners[2]];
        const Vector3f arm = q.placed(v.point), way = q.way(arm), from = arm + q.t;
        if (q.stays) return std::sqrt(distance2(from, a, b, c));
        return alongCourse(way.norm(), [&](float s) { return distance2<Vector3f>(from + s * way, a, b, c); });
    }
    template <class Q>
    static float faceVertex(const Q& q, int face, int vertex) {
        const SurfaceFeatures::Vertex& v = q.obstacle.features.vertices[vertex];
        const Vector3f n = q.R * q.tool.normals[face];
        for (int k = 0; k < v.spokes; ++k)
            if (q.obstacle.spokes[v.firstSpoke + k].dot(n) < -q.sine) return HUGE_VALF;
        const auto& corners = q.tool.features.faces[face].points;
        const Vector3f a = q.placed(corners[0]), b = q.placed(corners[1]), c = q.placed(corners[2]);
        const Vector3f p = q.obstacle.points[v.point] - q.t;
        if (q.stays) return std::sqrt(distance2(p, a, b, c));
        const Vector3f wa = q.way(a), wb = q.way(b), wc = q.way(c);
        const float length = std::sqrt(std::max({wa.squaredNorm(), wb.squaredNorm(), wc.squaredNorm()}));
        return alongCourse(length, [&](float s) { return distance2<Vector3f>(p, a + s * wa, b + s * wb, c + s * wc); });
    }
    template <class Q>
    static float edgeEdge(const Q& q, int moving, int resting) {
        const auto& ends = q.tool.features.edges[moving].points;
        const auto& others = q.obstacle.features.edges[resting].points;
        const Vector3f a = q.placed(ends[0]), a1 = q.placed(ends[1]), u = a1 - a;
        const Vector3f &b = q.obstacle.points[others[0]], v = q.obstacle.points[others[1]] - b;
        const Vector3f cross = u.cross(v);
        const float length2 = cross.squaredNorm(), parallel2 = u.squaredNorm() * v.squaredNorm();
        // A turn by an angle turns the common normal by up to the angle divided by the sine between the edges.
        const float between = std::sqrt(length2 / parallel2),
                    angle = q.angle * (1 + 1 / std::max(between - q.angle, 1e-6f));
        if (angle < kPi / 2) {
            const float limit = std::sin(angle) * std::sqrt(length2);
            const auto &wings = q.tool.wings[moving], &rest = q.obstacle.wings[resting];
            const float m0 = cross.dot(q.R * wings[0]), m1 = cross.dot(q.R * wings[1]), r0 = cross.dot(rest[0]),
                        r1 = cross.dot(rest[1]);
            const bool up = m0 >= -limit && m1 >= -limit && r0 <= limit && r1 <= limit;
            const bool down = m0 <= limit && m1 <= limit && r0 >= -limit && r1 >= -limit;
            if (!up && !down) return HUGE_VALF;
        }
        const Vector3f w = b - q.t;
        if (q.stays) return std::sqrt(edgeDistance2(a, u, w, v));
        const Vector3f wa = q.way(a), wu = q.way(a1) - wa;
        const float length = std::sqrt(std::max(wa.squaredNorm(), (wa + wu).squaredNorm()));
        return alongCourse(length, [&](float s) { return edgeDistance2<Vector3f>(a + s * wa, u + s * wu, w, v); });
    }
    template <class Q>
    static float of(const Q& q, const PairEntry& entry) {
        const int feature = featureOf(entry.tool);
        switch (kindOf(entry.tool)) {
            case PairKind::VertexFace:
                return vertexFace(q, feature, entry.obstacle);
            case PairKind::FaceVertex:
                return faceVertex(q, feature, entry.obstacle);
            default:
                return edgeEdge(q, feature, entry.obstacle);
        }
    }
};

/// Visits all pairs of children whose boxes come within the margin and whose cones can oppose, down to the features.
/// Returns false if `pair` did.
template <class Pair>
bool FeaturePairFinder::walk(const Query& q, const FeatureTree& tool, const FeatureTree& obstacle, Pair&& pair) {
    if (tool.count() == 0 || obstacle.count() == 0) return true;
    const auto& ours = tool.nodes();
    const auto& others = obstacle.nodes();
    // Lanes of a node's children that may meet a box (lo, hi) and a cone around -axis of this angle.
    const auto meets = [&](const FeatureTree::Node& node, const float lo[3], const float hi[3], const Vector3f& axis,
                           float angle, float cosine, float sine) {
        const Int8 near = (node.lo[0] <= splat(hi[0])) & (node.hi[0] >= splat(lo[0])) & (node.lo[1] <= splat(hi[1])) &
                          (node.hi[1] >= splat(lo[1])) & (node.lo[2] <= splat(hi[2])) & (node.hi[2] >= splat(lo[2]));
        const Mask mask = toMask(near);
        if (!mask || angle >= kPi) return mask;
        const Float8 dot = -(node.axis[0] * axis[0] + node.axis[1] * axis[1] + node.axis[2] * axis[2]);
        const Float8 least = node.cosine * cosine - node.sine * sine;
        return mask & toMask((least - splat(1e-5f) <= dot) | (node.angle >= splat(kPi - angle)));
    };
    const float cosAngle = std::cos(q.angle), sinAngle = std::sin(q.angle);
    int waiting = 0;
    stack_[std::size_t(waiting++)] = {0, 0};
    while (waiting > 0) {
        const PairEntry top = stack_[std::size_t(--waiting)];
        const FeatureTree::Node &a = ours[std::size_t(top.tool)], &b = others[std::size_t(top.obstacle)];
        if (a.isLeaf && !b.isLeaf) {
            float lo[3], hi[3];
            q.sweep(a.own.lo.data(), a.own.hi.data(), lo, hi);
            Mask mask = meets(b, lo, hi, q.R * a.own.axis, kPi, 0, 0);
            for (; mask; mask &= mask - 1)
                stack_[std::size_t(waiting++)] = {top.tool, b.first + std::countr_zero(mask)};
            continue;
        }
        // The children of the tool's node, each against the obstacle's node and, if both are as deep, its children.
        Float8 lo[3], hi[3], axis[3];
        q.sweep(a.lo, a.hi, lo, hi);
        const Int8 near = (lo[0] <= splat(b.own.hi[0])) & (hi[0] >= splat(b.own.lo[0])) &
                          (lo[1] <= splat(b.own.hi[1])) & (hi[1] >= splat(b.own.lo[1])) &
                          (lo[2] <= splat(b.own.hi[2])) & (hi[2] >= splat(b.own.lo[2]));
        Mask mask = toMask(near) & ((1u << a.count) - 1);
        if (!mask) continue;
        for (int k = 0; k < 3; ++k) axis[k] = q.R(k, 0) * a.axis[0] + q.R(k, 1) * a.axis[1] + q.R(k, 2) * a.axis[2];
        const Float8 angle = a.angle + q.angle, cosine = a.cosine * cosAngle - a.sine * sinAngle,
                     sine = a.sine * cosAngle + a.cosine * sinAngle;
        for (; mask; mask &= mask - 1) {
            const int i = std::countr_zero(mask);
            if (b.isLeaf && !a.isLeaf) {
                stack_[std::size_t(waiting++)] = {a.first + i, top.obstacle};
                continue;
            }
            const float l[3] = {lo[0][i], lo[1][i], lo[2][i]}, h[3] = {hi[0][i], hi[1][i], hi[2][i]};
            const Vector3f n(axis[0][i], axis[1][i], axis[2][i]);
            Mask found = meets(b, l, h, n, angle[i], cosine[i], sine[i]);
            for (; found; found &= found - 1) {
                const int j = b.first + std::countr_zero(found);
                if (!a.isLeaf)
                    stack_[std::size_t(waiting++)] = {a.first + i, j};
                else if (!pair(a.first + i, j))
                    return false;
            }
        }
    }
    return true;
}

void FeaturePairFinder::walkErased(const Coverage& asked, ErasedVisit visit, void* context) {
    const Query q(*tool_, *obstacle_, asked, guard(asked.course.X_OT), leastAbout_);
    const auto offer = [&](PairKind kind, int tool, int obstacle, float gap) {
        return gap > q.margin || visit(context, {toolFeature(kind, tool), obstacle}, gap);
    };
    const bool all =
        walk(q, tool_->vertices, obstacle_->faces,
             [&](int t, int o) { return offer(PairKind::VertexFace, t, o, FeatureMeasure::vertexFace(q, t, o)); }) &&
        walk(q, tool_->faces, obstacle_->vertices,
             [&](int t, int o) { return offer(PairKind::FaceVertex, t, o, FeatureMeasure::faceVertex(q, t, o)); });
    if (all)
        walk(q, tool_->edges, obstacle_->edges,
             [&](int t, int o) { return offer(PairKind::EdgeEdge, t, o, FeatureMeasure::edgeEdge(q, t, o)); });
}

bool FeaturePairFinder::search(const Coverage& asked, PairEntries& out) {
    out.count = 0;
    bool fits = true;
    forEachPair(asked, [&](const PairEntry& entry, float gap) {
        fits = out.count < out.capacity;
        if (!fits) return false;
        out.at[std::size_t(out.count)] = entry;
        out.gap[std::size_t(out.count)] = gap;
        out.sum[std::size_t(out.count++)] = 1;
        return true;
    });
    return fits;
}

void FeaturePairFinder::select(const PairEntries& from, const Coverage& asked, PairEntries& out) {
    const Query q(*tool_, *obstacle_, asked, guard(asked.course.X_OT), leastAbout_);
    int count = 0;
    forEachWithin(from, asked, [&](const PairEntry& entry) {
        const float gap = FeatureMeasure::of(q, entry);
        const auto at = std::size_t(count);
        out.at[at] = entry;
        out.gap[at] = gap;
        out.sum[at] = 1;
        count += gap <= q.margin;
        return true;
    });
    out.count = count;
}

NearestPoints FeaturePairFinder::nearest(const Pose& X_OT, const PairEntry& pair) const {
    const SurfaceFeatures &tool = tool_->features, &obstacle = obstacle_->features;
    const int feature = featureOf(pair.tool);
    switch (kindOf(pair.tool)) {
        case PairKind::VertexFace: {
            const Vec3 p = X_OT * tool.points[tool.vertices[feature].point];
            return {p, closestPoint(p, obstacle.triangle(pair.obstacle), false)};
        }
        case PairKind::FaceVertex: {
            Triangle face = tool.triangle(feature);
            for (Vec3& corner : face) corner = X_OT * corner;
            const Vec3& p = obstacle.points[obstacle.vertices[pair.obstacle].point];
            return {closestPoint(p, face, false), p};
        }
        default: {
            const auto &ends = tool.edges[feature].points, &others = obstacle.edges[pair.obstacle].points;
            const Vec3 a = X_OT * tool.points[ends[0]], u = X_OT * tool.points[ends[1]] - a;
            const Vec3 &b = obstacle.points[others[0]], v = obstacle.points[others[1]] - b;
            const auto [s, t] = nearestFractions<Vec3>(u, v, a - b);
            return {a + s * u, b + t * v};
        }
    }
}

}  // namespace touchstone
