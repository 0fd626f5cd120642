#pragma once
// How near eight pairs of features come during a motion.
#include <algorithm>
#include <cmath>

#include "haptics/math/tick_tuning.hpp"
#include "haptics/surface/feature_lanes.hpp"

namespace touchstone {

TOUCHSTONE_INLINE Float8 clamped(const Float8& s) {
    return simd::min(simd::max(s, simd::splat(0.0f)), simd::splat(1.0f));
}

/// The vectors from the nearest points of triangles with these normals of unit length to points.
TOUCHSTONE_INLINE Vec8 fromFace(const Vec8& p, const Vec8& a, const Vec8& b, const Vec8& c, const Vec8& normal) {
    const Vec8* const corners[3] = {&a, &b, &c};
    const Vec8 up = dot(normal, p - a) * normal;
    Float8 least = simd::splat(HUGE_VALF), inside = simd::splat(HUGE_VALF);
    Vec8 off = up;
    for (int k = 0; k < 3; ++k) {
        const Vec8 side = *corners[(k + 1) % 3] - *corners[k], arm = p - *corners[k];
        const Vec8 beside = fnma(clamped(dot(arm, side) / dot(side, side)), side, arm);
        const Float8 distance2 = dot(beside, beside);
        off = choose(distance2 < least, beside, off);
        least = simd::min(least, distance2);
        inside = simd::min(inside, dot(cross(normal, side), arm));
    }
    return choose(inside >= 0.0f, up, off);
}

/// The vectors from segments b + t v to the nearest points of segments a + s u; w = a - b.
/// Source: C. Ericson, Real-Time Collision Detection (2005), 5.1.9.
TOUCHSTONE_INLINE Vec8 fromEdge(const Vec8& u, const Vec8& v, const Vec8& w) {
    const Float8 uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
    const Float8 det = simd::fnma(uv, uv, uu * vv);
    const Float8 free = det > 1e-12f * uu * vv ? clamped(simd::fnma(uw, vv, uv * vw) / det) : simd::splat(0.0f);
    const Float8 t = simd::fma(uv, free, vw) / vv;
    const Float8 s = t < 0.0f ? clamped(-uw / uu) : t > 1.0f ? clamped((uv - uw) / uu) : free;
    return fnma(clamped(t), v, fma(s, u, w));
}

/// The directions of eight vectors; 0 for a zero vector.
TOUCHSTONE_INLINE Vec8 direction(const Vec8& v) {
    return 1.0f / simd::max(simd::sqrt(dot(v, v)), simd::splat(1e-18f)) * v;
}

/// Eight pairs on their motions.
struct Near8 {
    Float8 gap;       ///< lower bounds on their distances
    Vec8 off;         ///< the vector from one to the other where they were found nearest
    Float8 fraction;  ///< of the motion, there
};

/// `at(s)`: the vectors from one to the other at the fraction s of the motion; `length2`: squared lengths of the paths;
/// `spread`: twice the distance by which the paths of two points of the moving feature may differ from that of one
/// between them; `guard`: bound on the error of a distance; `quick`: whether a less close bound will do.
template <class At>
TOUCHSTONE_INLINE Near8 alongMotion(const Float8& length2, const Float8& spread, float guard, bool quick, At&& at) {
    const float longest2 = -simd::least(-length2);
    const Float8 length = simd::sqrt(length2);
    const int middles = longest2 < kShortLength * kShortLength ? 1 : quick ? kQuickParts : 0;
    Float8 nearest = simd::splat(HUGE_VALF), fraction = simd::splat(0.0f);
    Vec8 nearestOff = Eigen::Vector3f(Eigen::Vector3f::Zero());
    const auto measure = [&](float s) {
        const Vec8 off = at(s);
        const Float8 distance = simd::sqrt(dot(off, off));
        nearestOff = choose(distance < nearest, off, nearestOff);
        fraction = distance < nearest ? simd::splat(s) : fraction;
        nearest = simd::min(nearest, distance);
        return distance;
    };
    for (int i = 0; i < middles; ++i) measure((float(i) + 0.5f) / float(middles));
    if (middles) return {simd::max(nearest - 0.5f / float(middles) * length, simd::splat(0.0f)), nearestOff, fraction};
    const int n = std::clamp(int(std::ceil(std::sqrt(longest2) / kPartLength)), 2, kMotionParts);
    const float part = 1.0f / float(n);
    Float8 distance[kMotionParts + 1] = {};
    for (int i = 0; i <= n; ++i) distance[i] = measure(float(i) * part);
    // No distance changes by more than the path is long. While a convex feature translates, its distance from another
    // is also convex: behind two poses it is at least what their line leads to, which is exact for surfaces that slide.
    const Float8 off = part * spread + simd::splat(3 * guard);
    Float8 least = distance[0];
    for (int i = 0; i < n; ++i) {
        const Float8 &here = distance[i], &next = distance[i + 1];
        Float8 bound = 0.5f * (here + next - part * length);
        if (i > 0) bound = simd::max(bound, simd::min(here, 2.0f * here - distance[i - 1] - off));
        if (i + 1 < n) bound = simd::max(bound, simd::min(next, 2.0f * next - distance[i + 2] - off));
        least = simd::min(least, simd::min(bound, next));
    }
    return {simd::max(least, simd::splat(0.0f)), nearestOff, fraction};
}

}  // namespace touchstone
