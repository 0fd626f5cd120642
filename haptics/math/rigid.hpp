#pragma once
// Rigid poses and wrenches. Units everywhere in haptics: mm, N, mN·m (= N·mm), rad, ms.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace touchstone {

using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaternion<double, Eigen::DontAlign>;

/// Upper bound on the coordinates of bodies and poses, mm: one kilometer. There a double still resolves 1e-10 mm and a
/// float 0.06 mm. A larger coordinate is an error of its source (Pose::isValid).
inline constexpr double kLargestCoordinate = 1e6;

/// Pose X_AB of frame B in frame A: x_A = q x_B + p. `q` is kept at unit length by every function here.
struct Pose {
    Vec3 p = Vec3::Zero();  ///< mm
    Quat q = Quat::Identity();

    Mat3 R() const { return q.toRotationMatrix(); }
    bool isFinite() const { return p.allFinite() && q.coeffs().allFinite(); }
    /// Whether the pose is usable: it is finite, no coordinate exceeds kLargestCoordinate, and the length of q is
    /// between 1/2 and 2, so that q can be normalized. Every pose from outside (device, file, caller) is checked in
    /// this way before it is used.
    bool isValid() const {
        const double q2 = q.squaredNorm();  // NaN and infinity fail these comparisons
        return (p.array().abs() <= kLargestCoordinate).all() && q2 >= 0.25 && q2 <= 4;
    }
    Pose inverse() const { return {-(q.conjugate() * p), q.conjugate()}; }
    /// Equal to the last bit.
    friend bool operator==(const Pose& a, const Pose& b) { return a.p == b.p && a.q.coeffs() == b.q.coeffs(); }
};

inline Vec3 operator*(const Pose& X, const Vec3& x) { return X.q * x + X.p; }
inline Pose operator*(const Pose& X, const Pose& Y) { return {X * Y.p, (X.q * Y.q).normalized()}; }

/// Force (N) and torque (mN·m) on the hand, on world axes, about a point that the owner of the value names.
struct Wrench {
    Vec3 force = Vec3::Zero();
    Vec3 torque = Vec3::Zero();
    bool isFinite() const { return force.allFinite() && torque.allFinite(); }
    /// Whether all components are exactly zero.
    bool isZero() const { return force.isZero(0) && torque.isZero(0); }
};

/// Rotation by |w| rad about w.
inline Quat expRotation(const Vec3& w) {
    const double angle = w.norm();
    // Small angles use the series of sin(a/2)/a, since the quotient would lose digits.
    const double k = angle < 1e-4 ? 0.5 - angle * angle / 48 : std::sin(angle / 2) / angle;
    return Quat(std::cos(angle / 2), k * w.x(), k * w.y(), k * w.z());
}

/// The shortest rotation vector w with expRotation(w) = q; |w| <= pi.
inline Vec3 logRotation(const Quat& q) {
    const double sign = q.w() < 0 ? -1 : 1;
    const double s = q.vec().norm();
    const double angle = 2 * std::atan2(s, sign * q.w());
    const double k = s < 1e-9 ? 2 : angle / s;
    return sign * k * q.vec();
}

/// Translation and rotation vector from one pose to another, on world axes; exactly zero if the poses are equal.
inline Vec6 incrementBetween(const Pose& from, const Pose& to) {
    Vec6 x = Vec6::Zero();
    x.head<3>() = to.p - from.p;
    if (to.q.coeffs() != from.q.coeffs()) x.tail<3>() = logRotation(to.q * from.q.conjugate());
    return x;
}
/// The pose after the increment x.
inline Pose moved(const Pose& q, const Vec6& x) {
    return {q.p + x.head<3>(), (expRotation(x.tail<3>()) * q.q).normalized()};
}

}  // namespace touchstone
