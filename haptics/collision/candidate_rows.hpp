#pragma once
// Rows in single precision, from which those that a step crosses are selected.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "haptics/collision/sphere_tree.hpp"
#include "haptics/math/aligned.hpp"
#include "haptics/math/simd.hpp"

namespace touchstone {

/// Rows (n, r x n) and gaps of leaf pairs, in one frame, stored column by column. They are candidates only: the caller
/// checks every selected row in double. Real time: the constructor takes all memory; no lock, no throw.
class CandidateRows {
  public:
    explicit CandidateRows(int capacity);

    int size() const { return size_; }
    void clear() { size_ = 0, leastDistance2_ = simd::splat(std::numeric_limits<float>::infinity()); }
    bool isFull() const { return size_ > capacity_ - 8; }
    /// Appends the rows of one tool leaf and the eight obstacle leaves from `first`, for gaps up to `limit` mm. c is
    /// the center of the tool leaf, r the vector from C to it. Pre: not full.
    void append(int toolLeaf, const float c[3], float radius, const float r[3], const TreeLevel& obstacle, int first,
                float limit);

    /// Smallest distance of the centers over all pairs that append() tested, mm.
    float leastDistance() const { return std::sqrt(simd::least(leastDistance2_)); }
    int toolLeaf(int i) const { return toolLeaf_[i]; }
    int obstacleLeaf(int i) const { return obstacleLeaf_[i]; }

    /// Computes the gap that each row predicts after a step, g + n·shift + (r x n)·turn + slack |J|, and returns the
    /// smallest; infinity if there are no rows. |J| is the length of the row in the metric of the compliances. Negative
    /// g are multiplied by `share`.
    float measure(const Vec3& shift, const Vec3& turn, double slack, double compliance, double rotationCompliance,
                  double share);
    /// Calls visit(row) for every row whose predicted gap at the last measure() is at most `limit`, in order, until it
    /// returns false.
    template <class Visit>
    bool forEachBelow(float limit, Visit&& visit) const {
        for (int i = 0; i < size_; i += 8) {
            simd::Mask mask = simd::lessEqual(simd::load(&predicted_[i]), simd::splat(limit));
            mask &= 0xffu >> std::max(i + 8 - size_, 0);
            for (; mask; mask &= mask - 1)
                if (!visit(i + std::countr_zero(mask))) return false;
        }
        return true;
    }

  private:
    int size_ = 0, capacity_;
    simd::Float8 leastDistance2_{};
    AlignedVector<float> columns_[7];  ///< n, r x n, gap
    AlignedVector<float> predicted_;   ///< gaps after the step of the last measure()
    AlignedVector<std::int32_t> toolLeaf_, obstacleLeaf_;
};

/// Inline and without a branch on the number of hits: it is most of the cost of a long step where surfaces conform.
inline void CandidateRows::append(int toolLeaf, const float c[3], float radius, const float r[3],
                                  const TreeLevel& obstacle, int first, float limit) {
    using namespace simd;
    Float8 nx = c[0] - load(&obstacle.x[first]), ny = c[1] - load(&obstacle.y[first]),
           nz = c[2] - load(&obstacle.z[first]);
    const Float8 distance2 = sumOfProducts(nx, nx, ny, ny, nz, nz), distance = simd::sqrt(distance2);
    leastDistance2_ = leastDistance2_ < distance2 ? leastDistance2_ : distance2;
    const Float8 gap = distance - (load(&obstacle.r[first]) + radius);
    const Mask mask = lessEqual(gap, splat(limit));
    const Float8 inverse = 1.0f / max(distance, splat(1e-20f));
    nx *= inverse, ny *= inverse, nz *= inverse;
    compressStore(&columns_[0][size_], nx, mask);
    compressStore(&columns_[1][size_], ny, mask);
    compressStore(&columns_[2][size_], nz, mask);
    compressStore(&columns_[3][size_], sumOfProducts(r[1], nz, -r[2], ny), mask);
    compressStore(&columns_[4][size_], sumOfProducts(r[2], nx, -r[0], nz), mask);
    compressStore(&columns_[5][size_], sumOfProducts(r[0], ny, -r[1], nx), mask);
    compressStore(&columns_[6][size_], gap, mask);
    compressStore(&toolLeaf_[size_], splat(std::int32_t(toolLeaf)), mask);
    compressStore(&obstacleLeaf_[size_], splat(std::int32_t(first)) + lanes(), mask);
    size_ += std::popcount(mask);
}

}  // namespace touchstone
