#include "haptics/surface/feature_pair_finder.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

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

TOUCHSTONE_INLINE Float8 clamped(const Float8& s) { return min(max(s, splat(0.0f)), splat(1.0f)); }

/// Squared distances of points from triangles with these normals of unit length.
TOUCHSTONE_INLINE Float8 faceDistance2(const Vec8& p, const Vec8& a, const Vec8& b, const Vec8& c, const Vec8& normal) {
    const Vec8* const corners[3] = {&a, &b, &c};
    const Float8 height = dot(normal, p - a);
    Float8 least = splat(HUGE_VALF), inside = splat(HUGE_VALF);
    for (int k = 0; k < 3; ++k) {
        const Vec8 side = *corners[(k + 1) % 3] - *corners[k], arm = p - *corners[k];
        const Vec8 off = arm - clamped(dot(arm, side) / dot(side, side)) * side;
        least = min(least, dot(off, off));
        inside = min(inside, dot(cross(normal, side), arm));
    }
    return inside >= 0.0f ? height * height : least;
}

/// Squared distances of the segments a + s u and b + t v; w = a - b.
/// Source: C. Ericson, Real-Time Collision Detection (2005), 5.1.9.
TOUCHSTONE_INLINE Float8 edgeDistance2(const Vec8& u, const Vec8& v, const Vec8& w) {
    const Float8 uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
    const Float8 det = uu * vv - uv * uv;
    const Float8 free = det > 1e-12f * uu * vv ? clamped((uv * vw - uw * vv) / det) : splat(0.0f);
    const Float8 t = (uv * free + vw) / vv;
    const Float8 s = t < 0.0f ? clamped(-uw / uu) : t > 1.0f ? clamped((uv - uw) / uu) : free;
    const Vec8 off = w + s * u - clamped(t) * v;
    return dot(off, off);
}

/// Lower bounds on the distances of pairs on their courses. `at(s)`: squared distances at the fraction s of the course;
/// `length2`: squared lengths of the ways.
template <class At>
TOUCHSTONE_INLINE Float8 alongCourse(const Float8& length2, At&& at) {
    const float longest2 = -simd::least(-length2);
    if (longest2 == 0) return simd::sqrt(at(0.0f));
    const int n = std::clamp(int(std::ceil(std::sqrt(longest2) / kSampleWay)), 1, kSamples);
    Float8 least = splat(HUGE_VALF);
    const float half = 0.5f / float(n);
    for (int i = 0; i < n; ++i) least = min(least, at(float(2 * i + 1) * half));
    return max(simd::sqrt(least) - half * simd::sqrt(length2), splat(0.0f));
}

}  // namespace

/// Points in float are relative to the center of their part. `t`: from the obstacle's center to the tool's.
struct FeaturePairFinder::Query {
    const Surface &tool, &obstacle;
    Matrix3f R;
    Vector3f t, shift, turn;
    float margin, angle;  ///< angle: by which normals may differ from being opposite
    float sine;           ///< its sine, at most 1
    float cosAngle, sinAngle;
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
        angle = float(std::min(3 * turned + kDirectionGuard, std::numbers::pi));
        cosAngle = std::cos(angle);
        sinAngle = std::sin(angle);
        sine = angle < kPi / 2 ? sinAngle : 1.0f;
    }
    Vector3f placed(int point) const { return R * tool.points[point]; }  ///< about the tool's center
    /// The way of points of the tool at `arm` from its center.
    TOUCHSTONE_INLINE Vec8 way(const Vec8& arm) const { return Vec8(shift) + cross(turn, arm); }

    /// Whether a vertex of the tool, and which of eight of its edges, come within the margin of a box.
    bool vertexIsNear(int vertex, const FeatureBounds& box) const;
    Mask edgesNear(int first, const FeatureBounds& box) const;
    /// The gaps of eight pairs. `arm`: of the tool's vertices from its center, on the obstacle's axes; so are the
    /// tool's faces and edges. Infinite where the faces of two edges cannot oppose.
    Float8 vertexFaces(const Vec8& arm, const FaceLanes& faces) const;
    Float8 facesVertex(const FaceLanes& faces, const Vec8& vertices) const;
    Float8 edges(const EdgeLanes& ours, const EdgeLanes& wings, const EdgeLanes& others,
                 const EdgeLanes& otherWings) const;
    /// Those of a vertex or an edge with eight neighboring features; infinite where their normals cannot oppose.
    Float8 vertexFaces(int vertex, int firstFace) const;
    Float8 facesVertex(int firstFace, int vertex) const;
    Float8 edges(int edge, int firstEdge) const;

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
      leastAbout_(std::min(tool.extent.about.minCoeff(), tool.extent.reach)) {}

PairEntries FeaturePairFinder::entries() const {
    const SurfaceFeatures &ours = tool_->features, &others = obstacle_->features;
    const auto pairs = [](const auto& a, const auto& b) { return std::int64_t(a.size()) * std::int64_t(b.size()); };
    return PairEntries(pairs(ours.vertices, others.faces) + pairs(ours.faces, others.vertices) +
                       pairs(ours.edges, others.edges));
}

float FeaturePairFinder::guard(const Pose& X_OT) const {
    const double t = (X_OT * tool_->extent.center - obstacle_->extent.center).norm();
    return float(16 * 0x1p-24 * (tool_->extent.reach + obstacle_->extent.reach + t) + 1e-7);
}

bool FeaturePairFinder::Query::vertexIsNear(int vertex, const FeatureBounds& box) const {
    const Vector3f arm = placed(tool.features.vertices[vertex].point), from = arm + t,
                   to = from + shift + turn.cross(arm);
    return ((from.cwiseMin(to).array() <= box.hi.array() + margin) &&
            (from.cwiseMax(to).array() >= box.lo.array() - margin))
        .all();
}

Mask FeaturePairFinder::Query::edgesNear(int first, const FeatureBounds& box) const {
    const Vec8 arm0 = R * Vec8(tool.ends[0], first), arm1 = R * Vec8(tool.ends[1], first);
    const Vec8 from0 = Vec8(t) + arm0, from1 = Vec8(t) + arm1, to0 = from0 + way(arm0), to1 = from1 + way(arm1);
    const auto within = [&](const Float8& a, const Float8& b, const Float8& c, const Float8& d, int k) {
        return (min(min(a, b), min(c, d)) <= box.hi[k] + margin) & (max(max(a, b), max(c, d)) >= box.lo[k] - margin);
    };
    return toMask(within(from0.x, from1.x, to0.x, to1.x, 0) & within(from0.y, from1.y, to0.y, to1.y, 1) &
                  within(from0.z, from1.z, to0.z, to1.z, 2));
}

TOUCHSTONE_INLINE Float8 FeaturePairFinder::Query::vertexFaces(const Vec8& arm, const FaceLanes& f) const {
    const Vec8 from = arm + Vec8(t), path = way(arm);
    return alongCourse(dot(path, path),
                       [&](float s) { return faceDistance2(from + splat(s) * path, f.a, f.b, f.c, f.normal); });
}

TOUCHSTONE_INLINE Float8 FeaturePairFinder::Query::facesVertex(const FaceLanes& f, const Vec8& vertices) const {
    // The course is seen from the face, on which the vertex moves.
    const Vec8 p = vertices - Vec8(t), wa = way(f.a), wb = way(f.b), wc = way(f.c);
    return alongCourse(max(max(dot(wa, wa), dot(wb, wb)), dot(wc, wc)), [&](float s) {
        const Float8 share = splat(s);
        return faceDistance2(p, f.a + share * wa, f.b + share * wb, f.c + share * wc, f.normal);
    });
}

TOUCHSTONE_INLINE Float8 FeaturePairFinder::Query::edges(const EdgeLanes& ours, const EdgeLanes& wings,
                                                         const EdgeLanes& others, const EdgeLanes& otherWings) const {
    const Vec8 u = ours.second - ours.first, v = others.second - others.first, m = cross(u, v);
    const Float8 length = simd::sqrt(dot(m, m)), parallel = simd::sqrt(dot(u, u) * dot(v, v));
    // A turn by an angle turns the common normal by up to the angle divided by the sine between the edges.
    const Float8 between = length / parallel, off = angle * (1.0f + 1.0f / max(between - angle, splat(1e-6f)));
    const Float8 limit = min(off, splat(1.01f)) * length;
    const Float8 m0 = dot(wings.first, m), m1 = dot(wings.second, m), r0 = dot(otherWings.first, m),
                 r1 = dot(otherWings.second, m);
    const Int8 opposes =
        ((min(m0, m1) >= -limit) & (max(r0, r1) <= limit)) | ((max(m0, m1) <= limit) & (min(r0, r1) >= -limit));
    if (!toMask(opposes)) return splat(HUGE_VALF);
    const Vec8 path = way(ours.first), bend = way(ours.second) - path, w = ours.first + Vec8(t) - others.first;
    const Float8 gap = alongCourse(max(dot(path, path), dot(path + bend, path + bend)), [&](float s) {
        const Float8 share = splat(s);
        return edgeDistance2(u + share * bend, v, w + share * path);
    });
    return opposes ? gap : splat(HUGE_VALF);
}

Float8 FeaturePairFinder::Query::vertexFaces(int vertex, int firstFace) const {
    const SurfaceFeatures::Vertex& v = tool.features.vertices[vertex];
    const FaceLanes faces(obstacle, firstFace);
    Float8 least = splat(1.0f);
    for (int k = v.firstSpoke; k < v.firstSpoke + v.spokes; ++k)
        least = min(least, dot(Vector3f(R * tool.spokes[k]), faces.normal));
    if (!lessEqual(splat(-sine), least)) return splat(HUGE_VALF);
    return least >= -sine ? vertexFaces(placed(v.point), faces) : splat(HUGE_VALF);
}

Float8 FeaturePairFinder::Query::facesVertex(int firstFace, int vertex) const {
    const SurfaceFeatures::Vertex& v = obstacle.features.vertices[vertex];
    const FaceLanes faces = R * FaceLanes(tool, firstFace);
    Float8 least = splat(1.0f);
    for (int k = v.firstSpoke; k < v.firstSpoke + v.spokes; ++k)
        least = min(least, dot(obstacle.spokes[k], faces.normal));
    if (!lessEqual(splat(-sine), least)) return splat(HUGE_VALF);
    return least >= -sine ? facesVertex(faces, obstacle.points[v.point]) : splat(HUGE_VALF);
}

Float8 FeaturePairFinder::Query::edges(int edge, int firstEdge) const {
    const auto wing = [&](const Surface::Columns& of) {
        return Vector3f(R * Vector3f(of[0][edge], of[1][edge], of[2][edge]));
    };
    const auto& ends = tool.features.edges[edge].points;
    return edges({placed(ends[0]), placed(ends[1])}, {wing(tool.wings[0]), wing(tool.wings[1])},
                 {obstacle.ends, firstEdge}, {obstacle.wings, firstEdge});
}

/// A node of the tool on its course, in the obstacle's axes.
struct FeaturePairFinder::Swept {
    float lo[3], hi[3];
    Vector3f axis;
    float angle, cosine, sine;  ///< of the normals, with what a turn may add

    /// Lanes of nodes that it may meet.
    TOUCHSTONE_INLINE Mask meets(const FeatureTree::Bounds8& b) const {
        const Mask near = toMask((b.lo[0] <= splat(hi[0])) & (b.hi[0] >= splat(lo[0])) & (b.lo[1] <= splat(hi[1])) &
                                 (b.hi[1] >= splat(lo[1])) & (b.lo[2] <= splat(hi[2])) & (b.hi[2] >= splat(lo[2])));
        if (!near || angle >= kPi) return near;
        const Float8 opposite = -(b.axis[0] * axis[0] + b.axis[1] * axis[1] + b.axis[2] * axis[2]);
        const Float8 least = b.cosine * cosine - b.sine * sine;
        return near & toMask((least - splat(1e-5f) <= opposite) | (b.angle >= splat(kPi - angle)));
    }
    bool meets(const Vector3f& otherLo, const Vector3f& otherHi) const {
        for (int k = 0; k < 3; ++k)
            if (lo[k] > otherHi[k] || hi[k] < otherLo[k]) return false;
        return true;
    }
};

/// Calls visit(lane, Swept) for the lanes of eight nodes of the tool that come within a box.
template <class Visit>
bool FeaturePairFinder::forEachNear(const Query& q, const FeatureTree::Bounds8& nodes, const FeatureBounds& box,
                                    Visit&& visit) {
    Float8 lo[3], hi[3];
    q.sweep(nodes.lo, nodes.hi, lo, hi);
    Mask mask = toMask((lo[0] <= splat(box.hi[0])) & (hi[0] >= splat(box.lo[0])) & (lo[1] <= splat(box.hi[1])) &
                       (hi[1] >= splat(box.lo[1])) & (lo[2] <= splat(box.hi[2])) & (hi[2] >= splat(box.lo[2])));
    if (!mask) return true;
    const Vec8 axis = q.R * Vec8(nodes.axis[0], nodes.axis[1], nodes.axis[2]);
    const Float8 angle = nodes.angle + q.angle, cosine = nodes.cosine * q.cosAngle - nodes.sine * q.sinAngle,
                 sine = nodes.sine * q.cosAngle + nodes.cosine * q.sinAngle;
    for (; mask; mask &= mask - 1) {
        const int i = std::countr_zero(mask);
        const Swept swept{{lo[0][i], lo[1][i], lo[2][i]},
                          {hi[0][i], hi[1][i], hi[2][i]},
                          {axis.x[i], axis.y[i], axis.z[i]},
                          angle[i],
                          cosine[i],
                          sine[i]};
        if (!visit(i, swept)) return false;
    }
    return true;
}

/// Visits all pairs of patches whose features of these kinds come within the margin and can oppose each other, below a
/// pair of nodes. The higher node is split, or both. Returns false if `visit` did.
template <class Visit>
bool FeaturePairFinder::descend(const Query& q, FeatureKind kind, FeatureKind other, Node a, const Swept& swept, Node b,
                                Visit& visit) {
    constexpr int n = FeatureTree::kChildren;
    if (a.height == 0 && b.height == 0) return visit(a.index, swept, b.index);
    const auto splitObstacle = [&](const Node& mine, const Swept& of) {
        for (Mask mask = of.meets(obstacle_->tree.children(other, b.height, b.index)); mask; mask &= mask - 1)
            if (!descend(q, kind, other, mine, of, {b.height - 1, n * b.index + std::countr_zero(mask)}, visit))
                return false;
        return true;
    };
    if (b.height > a.height) return splitObstacle(a, swept);
    return forEachNear(q, tool_->tree.children(kind, a.height, a.index),
                       obstacle_->tree.bounds(other, b.height, b.index), [&](int lane, const Swept& of) {
                           const Node child{a.height - 1, n * a.index + lane};
                           return a.height > b.height ? descend(q, kind, other, child, of, b, visit)
                                                      : splitObstacle(child, of);
                       });
}

template <class Visit>
bool FeaturePairFinder::walk(const Query& q, FeatureKind kind, FeatureKind other, Visit&& visit) {
    const FeatureTree &ours = tool_->tree, &others = obstacle_->tree;
    if (ours.empty() || others.empty()) return true;
    const Node a{ours.height(), 0}, b{others.height(), 0};
    return forEachNear(q, ours.eight(kind, a.height, 0), others.bounds(other, b.height, 0),
                       [&](int, const Swept& swept) { return descend(q, kind, other, a, swept, b, visit); });
}

void FeaturePairFinder::walkErased(const Coverage& asked, ErasedVisit visit, void* context) {
    const Query q(*tool_, *obstacle_, asked, guard(asked.course.X_OT), leastAbout_);
    constexpr int n = FeatureTree::kChildren;
    // The pairs of one feature with up to eight others.
    const auto offer = [&](const Float8& gap, int count, auto&& pairWith) {
        for (Mask mask = lessEqual(gap, splat(q.margin)) & ((1u << count) - 1); mask; mask &= mask - 1) {
            const int lane = std::countr_zero(mask);
            if (!visit(context, pairWith(lane), gap[lane])) return false;
        }
        return true;
    };
    const auto vertexFaces = [&](int patch, const Swept&, int other) {
        const FeatureBounds box = obstacle_->tree.bounds(FeatureKind::Face, 0, other);
        for (int v = tool_->firstVertex[patch]; v < tool_->firstVertex[patch + 1]; ++v) {
            if (!q.vertexIsNear(v, box)) continue;
            if (!offer(q.vertexFaces(v, n * other), obstacle_->facesOf(other), [&](int lane) {
                    return PairEntry{toolFeature(PairKind::VertexFace, v), n * other + lane};
                }))
                return false;
        }
        return true;
    };
    const auto facesVertex = [&](int patch, const Swept& swept, int other) {
        for (int v = obstacle_->firstVertex[other]; v < obstacle_->firstVertex[other + 1]; ++v) {
            const Vector3f& p = obstacle_->points[obstacle_->features.vertices[v].point];
            if (!swept.meets(p, p)) continue;
            if (!offer(q.facesVertex(n * patch, v), tool_->facesOf(patch), [&](int lane) {
                    return PairEntry{toolFeature(PairKind::FaceVertex, n * patch + lane), v};
                }))
                return false;
        }
        return true;
    };
    const auto edges = [&](int patch, const Swept&, int other) {
        const FeatureBounds box = obstacle_->tree.bounds(FeatureKind::Edge, 0, other);
        const int end = tool_->firstEdge[patch + 1], otherEnd = obstacle_->firstEdge[other + 1];
        for (int eight = tool_->firstEdge[patch]; eight < end; eight += n) {
            Mask near = q.edgesNear(eight, box);
            if (end - eight < n) near &= (1u << (end - eight)) - 1;
            for (; near; near &= near - 1) {
                const int e = eight + std::countr_zero(near);
                for (int first = obstacle_->firstEdge[other]; first < otherEnd; first += n)
                    if (!offer(q.edges(e, first), std::min(n, otherEnd - first), [&](int lane) {
                            return PairEntry{toolFeature(PairKind::EdgeEdge, e), first + lane};
                        }))
                        return false;
            }
        }
        return true;
    };
    walk(q, FeatureKind::Vertex, FeatureKind::Face, vertexFaces) &&
        walk(q, FeatureKind::Face, FeatureKind::Vertex, facesVertex) &&
        walk(q, FeatureKind::Edge, FeatureKind::Edge, edges);
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

/// Calls visit(kind, features of the tool, of the obstacle, their number) for up to eight entries of one kind at a
/// time, of all that may hold a pair of the coverage, until it returns false. Places behind the number repeat the first
/// one.
template <class Visit>
void FeaturePairFinder::forEachEight(const PairEntries& entries, const Coverage& asked, Visit&& visit) const {
    PairKind kind{};
    int ours[8], others[8], count = 0;
    bool goOn = true;
    const auto flush = [&] {
        for (int i = count; i < 8; ++i) ours[i] = ours[0], others[i] = others[0];
        if (count > 0) goOn = visit(kind, ours, others, count);
        count = 0;
    };
    forEachWithin(entries, asked, [&](const PairEntry& entry) {
        if (count == 8 || kindOf(entry.tool) != kind) flush();
        kind = kindOf(entry.tool);
        ours[count] = featureOf(entry.tool);
        others[count++] = entry.obstacle;
        return goOn;
    });
    if (goOn) flush();
}

void FeaturePairFinder::select(const PairEntries& from, const Coverage& asked, PairEntries& out) {
    const Query q(*tool_, *obstacle_, asked, guard(asked.course.X_OT), leastAbout_);
    const Surface &tool = *tool_, &obstacle = *obstacle_;
    int count = 0;
    forEachEight(from, asked, [&](PairKind kind, const int* ours, const int* others, int n) {
        const Float8 gaps = kind == PairKind::VertexFace
                                ? q.vertexFaces(q.R * verticesOf(tool, ours), FaceLanes::of(obstacle, others))
                            : kind == PairKind::FaceVertex
                                ? q.facesVertex(q.R * FaceLanes::of(tool, ours), verticesOf(obstacle, others))
                                : q.edges(q.R * EdgeLanes::endsOf(tool, ours), q.R * EdgeLanes::of(tool.wings, ours),
                                          EdgeLanes::endsOf(obstacle, others), EdgeLanes::of(obstacle.wings, others));
        for (Mask mask = lessEqual(gaps, splat(q.margin)) & ((1u << n) - 1); mask; mask &= mask - 1) {
            const int i = std::countr_zero(mask);
            const auto at = std::size_t(count++);
            out.at[at] = {toolFeature(kind, ours[i]), others[i]};
            out.gap[at] = gaps[i];
            out.sum[at] = 1;
        }
        return true;
    });
    out.count = count;
}

void FeaturePairFinder::crossErased(const PairEntries& entries, const Coverage& asked, const Pose& before,
                                    const Pose& after, double least, ErasedCrossing visit, void* context) const {
    const CrossingSieve sieve(*tool_, *obstacle_, before, after, least, std::max(guard(before), guard(after)));
    forEachEight(entries, asked, [&](PairKind kind, const int* ours, const int* others, int n) {
        for (Mask mask = sieve.test(kind, ours, others) & ((1u << n) - 1); mask; mask &= mask - 1) {
            const int i = std::countr_zero(mask);
            if (!visit(context, {toolFeature(kind, ours[i]), others[i]})) return false;
        }
        return true;
    });
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
