#pragma once
// What a search for pairs of features tests: nodes of the two trees, and eight pairs at a time. Internal to
// FeaturePairFinder.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "haptics/surface/feature_pair_finder.hpp"
#include "haptics/surface/motion_gaps.hpp"

namespace touchstone {

/// Points in float are relative to the center of their part. `t`: from the obstacle's center to the tool's.
struct FeaturePairFinder::Query {
    const Surface &tool, &obstacle;
    Eigen::Matrix3f R;
    Eigen::Vector3f t, shift, turn;
    float guard;          ///< FeaturePairFinder::guard()
    float margin, angle;  ///< angle: by which normals may differ from being opposite
    float sine;           ///< its sine, at most 1
    float cosAngle, sinAngle;
    bool quick, stays;

    Query(const Surface& tool_, const Surface& obstacle_, const Coverage& asked, float guard_, double leastAbout,
          Bounds bounds)
        : tool(tool_), obstacle(obstacle_), guard(guard_), quick(bounds == Bounds::Quick) {
        const StraightMotion& motion = asked.motion;
        R = motion.X_OT.R().cast<float>();
        t = (motion.X_OT * tool.extent.center - obstacle.extent.center).cast<float>();
        shift = motion.shift.cast<float>();
        turn = motion.turn.cast<float>();
        stays = motion.stays();
        margin = float(asked.within.margin) + guard;
        // What serves this motion also serves steps near it: neither end of them has turned further, and the normals of
        // a step's pairs may be off by its own turn (FeatureList).
        const double turned = asked.within.margin / std::max(leastAbout, 1e-9) + motion.turn.norm();
        angle = float(std::min(turned + std::min(2 * turned, asked.within.turn) + kDirectionGuard, std::numbers::pi));
        cosAngle = std::cos(angle);
        sinAngle = std::sin(angle);
        sine = angle < std::numbers::pi_v<float> / 2 ? sinAngle : 1.0f;
    }
    /// The displacements of points of the tool at `arm` from its center.
    TOUCHSTONE_INLINE Vec8 displacement(const Vec8& arm) const { return Vec8(shift) + cross(turn, arm); }

    /// Bounds of eight points of the tool at `arm` from its center, over the motion, with the margin.
    TOUCHSTONE_INLINE Box8 swept(const Vec8& arm) const {
        const Vec8 from = arm + Vec8(t), to = from + displacement(arm);
        const Vec8 wide = Eigen::Vector3f(Eigen::Vector3f::Constant(margin));
        return {min(from, to) - wide, max(from, to) + wide};
    }
    /// Those of eight pairs whose distances on the motion no direction bounds. A
    /// motion that is expected may lead one part through the other, and behind it the vector between them points back.
    simd::Int8 through(const Float8& bounds) const { return quick ? bounds <= 0.0f : simd::lanes() < 0; }
    /// n, or where `atStart` is set the direction of that vector at the start of the motion.
    template <class At>
    TOUCHSTONE_INLINE static Vec8 orAtStart(const Vec8& n, const simd::Int8& atStart, At&& at) {
        return simd::toMask(atStart) ? choose(atStart, direction(at(0.0f)), n) : n;
    }
    /// For eight pairs of a kind: the gaps, and the directions along which they are apart.
    Float8 measure(PairKind kind, const int* ours, const int* others, Separation8& apart) const;
    Float8 vertexFaces(const Vec8& vertices, const FaceLanes& faces, Separation8& apart) const;
    Float8 facesVertex(const FaceLanes& faces, const Vec8& vertices, Separation8& apart) const;
    Float8 edges(const EdgeLanes& mine, const EdgeLanes& theirs, Separation8& apart) const;
    /// Whether edges u and v can have a common normal with all of their faces behind it.
    simd::Int8 opposing(const Vec8& u, const EdgeLanes& wings, const Vec8& v, const EdgeLanes& otherWings) const;
    /// Which of eight normals, on the axes of the vertex, can oppose a vertex of a part.
    simd::Mask opposes(const Surface& part, int vertex, const Vec8& normals) const;

    /// Boxes of eight nodes of the tool over the motion, with the margin, in the obstacle's axes from its center.
    TOUCHSTONE_INLINE Box8 sweep(const FeatureTree::Bounds8& nodes) const {
        const Vec8 lo(nodes.lo[0], nodes.lo[1], nodes.lo[2]), hi(nodes.hi[0], nodes.hi[1], nodes.hi[2]);
        const Vec8 arm = R * (simd::splat(0.5f) * (lo + hi)),
                   half = Eigen::Matrix3f(R.cwiseAbs()) * (simd::splat(0.5f) * (hi - lo));
        const Vec8 from = arm + Vec8(t), wide = half + Vec8(Eigen::Vector3f(Eigen::Vector3f::Constant(margin)));
        const Box8 start{from - wide, from + wide};
        if (stays) return start;
        const Vec8 path = displacement(arm), zero = Eigen::Vector3f(Eigen::Vector3f::Zero());
        const Eigen::Vector3f w = turn.cwiseAbs();
        const Vec8 grow(simd::sumOfProducts(w.y(), half.z, w.z(), half.y),
                        simd::sumOfProducts(w.z(), half.x, w.x(), half.z),
                        simd::sumOfProducts(w.x(), half.y, w.y(), half.x));
        return {start.lo + min(path - grow, zero), start.hi + max(path + grow, zero)};
    }
};

TOUCHSTONE_INLINE simd::Int8 FeaturePairFinder::Query::opposing(const Vec8& u, const EdgeLanes& wings, const Vec8& v,
                                                                const EdgeLanes& otherWings) const {
    const Vec8 m = cross(u, v);
    const Float8 length = simd::sqrt(dot(m, m)), parallel = simd::sqrt(dot(u, u) * dot(v, v));
    // A turn by an angle turns the common normal by up to the angle divided by the sine between the edges.
    const Float8 between = length / parallel,
                 off = angle * (1.0f + 1.0f / simd::max(between - angle, simd::splat(1e-6f)));
    const Float8 limit = simd::min(off, simd::splat(1.01f)) * length;
    const Float8 m0 = dot(wings.first, m), m1 = dot(wings.second, m), r0 = dot(otherWings.first, m),
                 r1 = dot(otherWings.second, m);
    return ((simd::min(m0, m1) >= -limit) & (simd::max(r0, r1) <= limit)) |
           ((simd::max(m0, m1) <= limit) & (simd::min(r0, r1) >= -limit));
}

/// A node of the tool on its motion, in the obstacle's axes.
struct FeaturePairFinder::Swept {
    float lo[3], hi[3];
    Eigen::Vector3f axis;
    float angle, cosine, sine;  ///< of the normals, with what a turn may add

    /// Lanes of nodes that it may meet.
    TOUCHSTONE_INLINE simd::Mask meets(const FeatureTree::Bounds8& b) const {
        const simd::Int8 near = (b.lo[0] <= simd::splat(hi[0])) & (b.hi[0] >= simd::splat(lo[0])) &
                                (b.lo[1] <= simd::splat(hi[1])) & (b.hi[1] >= simd::splat(lo[1])) &
                                (b.lo[2] <= simd::splat(hi[2])) & (b.hi[2] >= simd::splat(lo[2]));
        const Float8 opposite = -simd::sumOfProducts(axis[0], b.axis[0], axis[1], b.axis[1], axis[2], b.axis[2]);
        const Float8 least = simd::fnma(sine, b.sine, b.cosine * cosine);
        return simd::toMask(near & ((least - simd::splat(1e-5f) <= opposite) |
                                    (b.angle >= simd::splat(std::numbers::pi_v<float> - angle))));
    }
    bool meets(const Eigen::Vector3f& otherLo, const Eigen::Vector3f& otherHi) const {
        for (int k = 0; k < 3; ++k)
            if (lo[k] > otherHi[k] || hi[k] < otherLo[k]) return false;
        return true;
    }
};

/// The box of one of eight nodes, eight times.
TOUCHSTONE_INLINE Box8 boxOf(const FeatureTree::Bounds8& nodes, int i) {
    const auto all = [i](const Float8* side) {
        return Vec8(simd::splat(side[0][i]), simd::splat(side[1][i]), simd::splat(side[2][i]));
    };
    return {all(nodes.lo), all(nodes.hi)};
}

/// Eight nodes of the tool on their motion.
struct FeaturePairFinder::Swept8 {
    Box8 box;
    Vec8 axis;
    Float8 angle, cosine, sine;

    Swept8(const Query& q, const FeatureTree::Bounds8& nodes)
        : box(q.sweep(nodes)),
          axis(q.R * Vec8(nodes.axis[0], nodes.axis[1], nodes.axis[2])),
          angle(nodes.angle + q.angle),
          cosine(nodes.cosine * q.cosAngle - nodes.sine * q.sinAngle),
          sine(nodes.sine * q.cosAngle + nodes.cosine * q.sinAngle) {}
    Swept lane(int i) const {
        return {{box.lo.x[i], box.lo.y[i], box.lo.z[i]},
                {box.hi.x[i], box.hi.y[i], box.hi.z[i]},
                {axis.x[i], axis.y[i], axis.z[i]},
                angle[i],
                cosine[i],
                sine[i]};
    }
};

}  // namespace touchstone
