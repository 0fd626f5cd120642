#include "haptics/collision/far_rows.hpp"

#include <limits>

namespace touchstone {

using namespace simd;

FarRows::FarRows(int capacity) : capacity_(capacity) {
    const auto padded = static_cast<std::size_t>(capacity) + 8;
    for (auto& column : columns_) column.resize(padded);
    left_.resize(padded);
    toolLeaf_.resize(padded);
    obstacleLeaf_.resize(padded);
}

void FarRows::append(int toolLeaf, int firstObstacleLeaf, const Float8 d[3], const Float8& distance, const Float8& gap,
                     const float r[3], Mask mask) {
    const Float8 inverse = distance > 0.0f ? 1.0f / distance : splat(0.0f);
    const Float8 n[3] = {d[0] * inverse, d[1] * inverse, d[2] * inverse};
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        compressStore(&columns_[k][size_], n[k], mask);
        compressStore(&columns_[3 + k][size_], r[i] * n[j] - r[j] * n[i], mask);
    }
    compressStore(&columns_[6][size_], gap, mask);
    compressStore(&toolLeaf_[size_], splat(std::int32_t(toolLeaf)), mask);
    compressStore(&obstacleLeaf_[size_], splat(std::int32_t(firstObstacleLeaf)) + lanes(), mask);
    size_ += std::popcount(mask);
}

float FarRows::measure(const Vec3& shift, const Vec3& turn, double slack, double compliance, double rotationCompliance,
                       bool notDeeper) {
    Float8 x[6];
    for (int k = 0; k < 3; ++k) x[k] = splat(float(shift[k])), x[3 + k] = splat(float(turn[k]));
    const Float8 none = splat(std::numeric_limits<float>::infinity());
    Float8 least8 = none;
    for (int i = 0; i < size_; i += 8) {
        Float8 left = load(&columns_[6][i]);
        if (notDeeper) left = max(left, splat(0.0f));
        for (int k = 0; k < 6; ++k) left += load(&columns_[k][i]) * x[k];
        if (slack > 0) {
            Float8 length2 = splat(0.0f);
            for (int k = 3; k < 6; ++k) length2 += load(&columns_[k][i]) * load(&columns_[k][i]);
            left += float(slack) * simd::sqrt(float(compliance) + float(rotationCompliance) * length2);
        }
        if (i + 8 > size_) left = splat(std::int32_t(size_ - i)) > lanes() ? left : none;
        store(&left_[i], left);
        least8 = least8 < left ? least8 : left;
    }
    return least(least8);
}

}  // namespace touchstone
