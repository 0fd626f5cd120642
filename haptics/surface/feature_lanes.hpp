#pragma once
// Eight features of a part side by side, for tests in float.
#include "haptics/math/simd.hpp"
#include "haptics/surface/surface.hpp"

namespace touchstone {

using simd::Float8;

/// Added to angles, rad: more than the rounding of directions in float.
inline constexpr double kDirectionGuard = 1e-4;

/// Eight vectors.
struct Vec8 {
    Float8 x, y, z;

    TOUCHSTONE_INLINE Vec8(const Float8& x_, const Float8& y_, const Float8& z_) : x(x_), y(y_), z(z_) {}
    TOUCHSTONE_INLINE Vec8(const Eigen::Vector3f& v)
        : x(simd::splat(v.x())), y(simd::splat(v.y())), z(simd::splat(v.z())) {}  // NOLINT
    /// One of them, eight times.
    TOUCHSTONE_INLINE Vec8 all(int i) const { return Eigen::Vector3f(x[i], y[i], z[i]); }
    TOUCHSTONE_INLINE friend Vec8 operator+(const Vec8& a, const Vec8& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    TOUCHSTONE_INLINE friend Vec8 operator-(const Vec8& a, const Vec8& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    TOUCHSTONE_INLINE friend Vec8 operator*(const Float8& s, const Vec8& a) { return {s * a.x, s * a.y, s * a.z}; }
    /// s a + b and b - s a, rounded once.
    TOUCHSTONE_INLINE friend Vec8 fma(const Float8& s, const Vec8& a, const Vec8& b) {
        return {simd::fma(s, a.x, b.x), simd::fma(s, a.y, b.y), simd::fma(s, a.z, b.z)};
    }
    TOUCHSTONE_INLINE friend Vec8 fnma(const Float8& s, const Vec8& a, const Vec8& b) {
        return {simd::fnma(s, a.x, b.x), simd::fnma(s, a.y, b.y), simd::fnma(s, a.z, b.z)};
    }
    TOUCHSTONE_INLINE friend Float8 dot(const Vec8& a, const Vec8& b) {
        return simd::sumOfProducts(a.x, b.x, a.y, b.y, a.z, b.z);
    }
    TOUCHSTONE_INLINE friend Vec8 cross(const Vec8& a, const Vec8& b) {
        return {simd::fnma(a.z, b.y, a.y * b.z), simd::fnma(a.x, b.z, a.z * b.x), simd::fnma(a.y, b.x, a.x * b.y)};
    }
    TOUCHSTONE_INLINE friend Vec8 operator*(const Eigen::Matrix3f& R, const Vec8& a) {
        return fma(a.z, Vec8(R.col(2)), fma(a.y, Vec8(R.col(1)), a.x * Vec8(R.col(0))));
    }
};

/// a where the lane of `which` is set, and else b.
TOUCHSTONE_INLINE Vec8 choose(const simd::Int8& which, const Vec8& a, const Vec8& b) {
    return {which ? a.x : b.x, which ? a.y : b.y, which ? a.z : b.z};
}
TOUCHSTONE_INLINE Vec8 min(const Vec8& a, const Vec8& b) {
    return {simd::min(a.x, b.x), simd::min(a.y, b.y), simd::min(a.z, b.z)};
}
TOUCHSTONE_INLINE Vec8 max(const Vec8& a, const Vec8& b) {
    return {simd::max(a.x, b.x), simd::max(a.y, b.y), simd::max(a.z, b.z)};
}

/// Eight boxes.
struct Box8 {
    Vec8 lo, hi;

    TOUCHSTONE_INLINE friend Box8 operator|(const Box8& a, const Box8& b) { return {min(a.lo, b.lo), max(a.hi, b.hi)}; }
    TOUCHSTONE_INLINE simd::Mask meets(const Box8& b) const {
        return simd::toMask((lo.x <= b.hi.x) & (hi.x >= b.lo.x) & (lo.y <= b.hi.y) & (hi.y >= b.lo.y) &
                            (lo.z <= b.hi.z) & (hi.z >= b.lo.z));
    }
    TOUCHSTONE_INLINE Box8 all(int i) const { return {lo.all(i), hi.all(i)}; }
};

/// Eight vectors that are set one by one.
struct Gathered {
    alignas(32) float x[8], y[8], z[8];

    template <class V>
    TOUCHSTONE_INLINE void set(int lane, const V& v) {
        x[lane] = float(v[0]), y[lane] = float(v[1]), z[lane] = float(v[2]);
    }
    TOUCHSTONE_INLINE operator Vec8() const { return {simd::load(x), simd::load(y), simd::load(z)}; }  // NOLINT
};

TOUCHSTONE_INLINE Vec8 verticesOf(const Surface& part, const int* vertices) {
    Gathered at;
    for (int i = 0; i < 8; ++i) at.set(i, part.points[part.features.vertices[vertices[i]].point]);
    return at;
}

/// Eight features: neighbors, or any.
class Eight {
  public:
    TOUCHSTONE_INLINE Eight(const AlignedVector<Surface::Record>& of, int first) {
        for (int i = 0; i < 8; ++i) at_[i] = of[first + i].data();
    }
    TOUCHSTONE_INLINE Eight(const AlignedVector<Surface::Record>& of, const int* which) {
        for (int i = 0; i < 8; ++i) at_[i] = of[which[i]].data();
    }
    /// n numbers of each record from `first` on, each of all eight together.
    template <int n>
    TOUCHSTONE_INLINE std::array<simd::Float8, n> columns(int first = 0) const {
        std::array<simd::Float8, n> all;
        for (int k = 0; k < n; k += 4) simd::transpose(at_, first + k, &all[k]);
        return all;
    }

  private:
    const float* at_[8];
};

/// Eight faces.
struct FaceLanes {
    Vec8 a, b, c, normal;

    TOUCHSTONE_INLINE explicit FaceLanes(const Eight& faces) : FaceLanes(faces.columns<12>()) {}
    TOUCHSTONE_INLINE explicit FaceLanes(const std::array<simd::Float8, 12>& v)
        : a(v[0], v[1], v[2]), b(v[3], v[4], v[5]), c(v[6], v[7], v[8]), normal(v[9], v[10], v[11]) {}
    TOUCHSTONE_INLINE FaceLanes(const Vec8& a_, const Vec8& b_, const Vec8& c_, const Vec8& normal_)
        : a(a_), b(b_), c(c_), normal(normal_) {}
    TOUCHSTONE_INLINE Box8 box() const { return {min(min(a, b), c), max(max(a, b), c)}; }
    TOUCHSTONE_INLINE friend FaceLanes operator*(const Eigen::Matrix3f& R, const FaceLanes& f) {
        return {R * f.a, R * f.b, R * f.c, R * f.normal};
    }
};

/// The ends of eight edges, or their wings.
struct EdgeLanes {
    Vec8 first, second;

    TOUCHSTONE_INLINE static EdgeLanes ends(const Eight& edges) {
        const auto v = edges.columns<8>();
        return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
    }
    TOUCHSTONE_INLINE static EdgeLanes wings(const Eight& edges) {
        const auto v = edges.columns<8>(4);
        return {{v[2], v[3], v[4]}, {v[5], v[6], v[7]}};
    }
    TOUCHSTONE_INLINE EdgeLanes(const Vec8& first_, const Vec8& second_) : first(first_), second(second_) {}
    TOUCHSTONE_INLINE EdgeLanes all(int i) const { return {first.all(i), second.all(i)}; }
    TOUCHSTONE_INLINE Box8 box() const { return {min(first, second), max(first, second)}; }
    TOUCHSTONE_INLINE friend EdgeLanes operator*(const Eigen::Matrix3f& R, const EdgeLanes& e) {
        return {R * e.first, R * e.second};
    }
};

}  // namespace touchstone
