#pragma once
// An orthonormal basis of the active rows of a projection on a polyhedron.
#include "haptics/qp/simd.hpp"

namespace touchstone {

/// Up to seven independent unit rows n_j with offsets d_j, the planes n_j·z + d_j = 0, as N = [n_0 n_1 ...] = Q R.
/// Vectors fill lanes 0..6 of a Vec8; lane 7 is zero. Every state depends on the ordered rows alone, not on the way
/// there: a row that leaves has its successors orthogonalised anew, so no error builds up over hundreds of pivots.
class ActiveBasis {
  public:
    static constexpr int kMax = 7;

    /// n = Q along + across = N weights + across, with `across` orthogonal to every active row.
    struct Split {
        Vec8 along, weights, across;
        double across2;  ///< |across|²
    };

    int size() const { return size_; }
    void clear() { *this = ActiveBasis(); }

    Split split(const Vec8& n) const {
        Split s;
        s.along = times8(transposed_, n);
        s.across = n - times8(q_, s.along);
        // Once is not enough for nearly parallel rows; twice is (Kahan and Parlett).
        const Vec8 rest = times8(transposed_, s.across);
        s.along += rest;
        s.across -= times8(q_, rest);
        s.weights = times8(inverse_, s.along);
        s.across2 = sum8(s.across * s.across);
        return s;
    }

    /// Pre: size() < kMax, and s = split(n) with s.across2 > 0.
    void append(const Vec8& n, double d, const Split& s) {
        const int k = size_++;
        const double length = __builtin_sqrt(s.across2);
        normals_[k] = n;
        offsets_[k] = d;
        q_[k] = s.across / length;
        for (int i = 0; i < kMax; ++i) transposed_[i][k] = q_[k][i];
        inverse_[k] = s.weights / -length;
        inverse_[k][k] = 1 / length;
        heights_[k] = (d - sum8(s.along * heights_)) / length;
    }

    void drop(int j) {
        Vec8 normals[kMax];
        double offsets[kMax];
        const int end = size_;
        for (int i = j + 1; i < end; ++i) {
            normals[i] = normals_[i];
            offsets[i] = offsets_[i];
        }
        truncate(j);
        for (int i = j + 1; i < end; ++i) append(normals[i], offsets[i], split(normals[i]));
    }

    /// The point nearest to the origin on all active planes, z = N multipliers(), and its multipliers.
    Vec8 nearest() const { return -times8(q_, heights_); }
    Vec8 multipliers() const { return -times8(inverse_, heights_); }
    Vec8 normal(int j) const { return normals_[j]; }

  private:
    void truncate(int size) {
        for (int k = size; k < size_; ++k) {
            q_[k] = inverse_[k] = Vec8{};
            for (int i = 0; i < kMax; ++i) transposed_[i][k] = 0;
            heights_[k] = 0;
        }
        size_ = size;
    }

    int size_ = 0;
    Vec8 q_[kMax]{};           ///< columns of Q
    Vec8 transposed_[kMax]{};  ///< its rows
    Vec8 inverse_[kMax]{};     ///< columns of R⁻¹
    Vec8 heights_{};           ///< R⁻ᵀ d: the active planes' distances along the columns of Q
    Vec8 normals_[kMax]{};
    double offsets_[kMax]{};
};

}  // namespace touchstone
