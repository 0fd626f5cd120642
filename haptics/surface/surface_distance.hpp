#pragma once
// Nearest points of features, and of two parts. All lengths in mm.
#include <algorithm>
#include <optional>

#include "haptics/surface/surface.hpp"

namespace touchstone {

/// In the frame of the obstacle.
struct NearestPoints {
    Vec3 onTool, onObstacle;
    double distance() const { return (onTool - onObstacle).norm(); }
};

/// The fractions s and t at which two segments a + s u and b + t v are nearest; w = a - b.
/// Source: C. Ericson, Real-Time Collision Detection (2005), 5.1.9.
template <class V, class Real = typename V::Scalar>
std::pair<Real, Real> nearestFractions(const V& u, const V& v, const V& w) {
    const Real uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), uw = u.dot(w), vw = v.dot(w);
    const Real det = uu * vv - uv * uv;
    Real s = det > Real(1e-12) * uu * vv ? std::clamp((uv * vw - uw * vv) / det, Real(0), Real(1)) : Real(0);
    Real t = (uv * s + vw) / vv;
    if (t < 0) {
        t = 0;
        s = std::clamp(-uw / uu, Real(0), Real(1));
    } else if (t > 1) {
        t = 1;
        s = std::clamp((uv - uw) / uu, Real(0), Real(1));
    }
    return {s, t};
}

/// A face of the tool and one of the obstacle.
struct FacePair {
    int tool = 0, obstacle = 0;
};

/// The nearest points of the surfaces of two parts with the tool node at X_OT in the obstacle's frame: at distance 0
/// where the surfaces intersect, and nothing if they are farther apart than `atMost`. `nearest` is a pair to start
/// from, best that of a nearby pose, and is replaced by the pair found; it saves time and does not change the distance.
/// By branch and bound; exact in double for the pair found. A part inside the other is as far away as its surface.
std::optional<NearestPoints> nearestPoints(const Surface& tool, const Surface& obstacle, const Pose& X_OT,
                                           double atMost = 1e30, FacePair* nearest = nullptr);

/// Distance of a point, in the part's frame, from the surface; `atMost` if it is not smaller.
double distanceTo(const Surface& surface, const Vec3& point, double atMost = 1e30);

/// The first point of the surface on a ray, in the part's frame; nothing if the ray misses it.
std::optional<Vec3> firstHit(const Surface& surface, const Vec3& from, const Vec3& direction);

}  // namespace touchstone
