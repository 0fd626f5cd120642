#pragma once
// An orthonormal basis of the active rows of a projection on a polyhedron.
#include "haptics/math/simd.hpp"

namespace touchstone {

/// Up to seven independent unit rows n_j with offsets d_j, the planes n_j·z + d_j = 0, as N = [n_0 n_1 ...] = Q R.
/// Vectors fill lanes 0..6 of a simd::Double8; lane 7 is zero. The state depends only on the ordered rows, not on the
/// sequence of pivots: when a row is dropped, the rows after it are orthogonalized again, so no error builds up over
/// hundreds of pivots.
class ActiveBasis {
  public:
    static constexpr int kMax = 7;

    /// n = Q along + across = N weights + across, with `across` orthogonal to every active row.
    struct Split {
        simd::Double8 along, weights, across;
        double across2;  ///< |across|²
    };

    int size() const { return size_; }
    void clear() { *this = ActiveBasis(); }

    Split split(const simd::Double8& n) const {
        Split s;
        s.along = simd::times(transposed_, n);
        s.across = n - simd::times(q_, s.along);
        // One orthogonalization is not enough for nearly parallel rows; two are (Kahan and Parlett).
        const simd::Double8 rest = simd::times(transposed_, s.across);
        s.along += rest;
        s.across -= simd::times(q_, rest);
        s.weights = simd::times(inverse_, s.along);
        s.across2 = simd::sum(s.across * s.across);
        return s;
    }

    /// Pre: size() < kMax, and s = split(n) with s.across2 > 0.
    void append(const simd::Double8& n, double d, const Split& s) {
        const int k = size_++;
        const double length = __builtin_sqrt(s.across2);
        normals_[k] = n;
        offsets_[k] = d;
        q_[k] = s.across / length;
        for (int i = 0; i < kMax; ++i) transposed_[i][k] = q_[k][i];
        inverse_[k] = s.weights / -length;
        inverse_[k][k] = 1 / length;
        heights_[k] = (d - simd::sum(s.along * heights_)) / length;
    }

    void drop(int j) {
        simd::Double8 normals[kMax];
        double offsets[kMax];
        const int end = size_;
        for (int i = j + 1; i < end; ++i) {
            normals[i] = normals_[i];
            offsets[i] = offsets_[i];
        }
        truncate(j);
        for (int i = j + 1; i < end; ++i) append(normals[i], offsets[i], split(normals[i]));
    }

    /// The point of all active planes that is nearest to the origin, z = N multipliers(), and its multipliers.
    simd::Double8 nearest() const { return -simd::times(q_, heights_); }
    simd::Double8 multipliers() const { return -simd::times(inverse_, heights_); }
    simd::Double8 normal(int j) const { return normals_[j]; }

    /// Greatest entry of R⁻¹: the factor by which rounding errors of the rows grow in multipliers and weights.
    double largestInverse() const {
        simd::Double8 largest{};
        for (const simd::Double8& column : inverse_) largest = simd::max(simd::abs(column), largest);
        return simd::largest(largest);
    }
    /// Greatest distance of an active plane along the columns of Q.
    double largestHeight() const { return simd::largest(simd::abs(heights_)); }

    /// The corrections du and dz that put z + dz = N (u + du) on the planes, computed from the planes' residuals
    /// n_j·z + d_j and from z - N u.
    void correct(const simd::Double8& residuals, const simd::Double8& imbalance, simd::Double8& du,
                 simd::Double8& dz) const {
        simd::Double8 along = simd::times(transposed_, imbalance);
        for (int k = 0; k < kMax; ++k) along[k] -= simd::sum(inverse_[k] * residuals);
        du = simd::times(inverse_, along);
        dz = simd::times(q_, along) - imbalance;
    }

  private:
    void truncate(int size) {
        for (int k = size; k < size_; ++k) {
            q_[k] = inverse_[k] = simd::Double8{};
            for (int i = 0; i < kMax; ++i) transposed_[i][k] = 0;
            heights_[k] = 0;
        }
        size_ = size;
    }

    int size_ = 0;
    simd::Double8 q_[kMax]{};           ///< columns of Q
    simd::Double8 transposed_[kMax]{};  ///< rows of Q
    simd::Double8 inverse_[kMax]{};     ///< columns of R⁻¹
    simd::Double8 heights_{};           ///< R⁻ᵀ d: the active planes' distances along the columns of Q
    simd::Double8 normals_[kMax]{};
    double offsets_[kMax]{};
};

}  // namespace touchstone
