#pragma once
// Rows in single precision, among which a step's crossed ones are looked for.
#include <cstdint>
#include <vector>

#include "haptics/math/aligned.hpp"
#include "haptics/math/rigid.hpp"
#include "haptics/math/simd.hpp"

namespace touchstone {

/// Rows (n, r x n), gap of leaf pairs, in one frame, column by column. They tell where to look: what they find is for
/// the caller to check in double. Real time: all memory is taken in the constructor; no lock, no throw.
class FarRows {
  public:
    explicit FarRows(int capacity);

    int size() const { return size_; }
    void clear() { size_ = 0; }
    bool isFull() const { return size_ > capacity_ - 8; }
    /// Rows of one tool leaf against lanes of an obstacle bucket. d: centres from obstacle to tool, r: from C to the
    /// tool leaf's centre. Pre: not full.
    void append(int toolLeaf, int firstObstacleLeaf, const simd::Float8 d[3], const simd::Float8& distance,
                const simd::Float8& gap, const float r[3], simd::Mask mask);

    int toolLeaf(int i) const { return toolLeaf_[i]; }
    int obstacleLeaf(int i) const { return obstacleLeaf_[i]; }

    /// What is left of each gap after a step, least of all: g + n·shift + (r x n)·turn, and `slack` times the length of
    /// a row whose translation and rotation count as much as the compliances say; negative g count as zero if
    /// `notDeeper`. Infinity if there are no rows.
    float measure(const Vec3& shift, const Vec3& turn, double slack, double compliance, double rotationCompliance,
                  bool notDeeper);
    /// visit(row) for every row with no more left than that at the last measure(), in order, until it returns false.
    template <class Visit>
    bool forEachBelow(float limit, Visit&& visit) const {
        for (int i = 0; i < size_; i += 8) {
            simd::Mask mask = simd::lessEqual(simd::load(&left_[i]), simd::splat(limit));
            for (; mask; mask &= mask - 1)
                if (!visit(i + std::countr_zero(mask))) return false;
        }
        return true;
    }

  private:
    int size_ = 0, capacity_;
    AlignedVector<float> columns_[7];  ///< n, r x n, gap
    AlignedVector<float> left_;
    std::vector<std::int32_t> toolLeaf_, obstacleLeaf_;
};

}  // namespace touchstone
