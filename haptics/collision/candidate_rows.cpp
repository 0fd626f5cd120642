#include "haptics/collision/candidate_rows.hpp"

#include <limits>

namespace touchstone {

using namespace simd;

CandidateRows::CandidateRows(int capacity) : capacity_(capacity) {
    const auto padded = static_cast<std::size_t>(capacity) + 8;
    for (auto& column : columns_) column.resize(padded);
    predicted_.resize(padded);
    toolLeaf_.resize(padded);
    obstacleLeaf_.resize(padded);
}

float CandidateRows::measure(const Vec3& shift, const Vec3& turn, double slack, double compliance,
                             double rotationCompliance, double share) {
    const Float8 x0 = splat(float(shift.x())), x1 = splat(float(shift.y())), x2 = splat(float(shift.z()));
    const Float8 x3 = splat(float(turn.x())), x4 = splat(float(turn.y())), x5 = splat(float(turn.z()));
    const Float8 overlaps = splat(float(share));
    const Float8 none = splat(std::numeric_limits<float>::infinity());
    const float* columns[7];
    for (int k = 0; k < 7; ++k) columns[k] = columns_[k].data();
    Float8 least8 = none;
    for (int i = 0; i < size_; i += 8) {
        const Float8 gap = load(columns[6] + i), u = load(columns[3] + i), v = load(columns[4] + i),
                     w = load(columns[5] + i);
        Float8 predicted = gap < 0.0f ? overlaps * gap : gap;
        predicted = fma(w, x5, fma(v, x4, fma(u, x3, predicted)));
        predicted += sumOfProducts(load(columns[0] + i), x0, load(columns[1] + i), x1, load(columns[2] + i), x2);
        if (slack > 0)
            predicted += float(slack) *
                         simd::sqrt(float(compliance) + float(rotationCompliance) * sumOfProducts(u, u, v, v, w, w));
        if (i + 8 > size_) predicted = splat(std::int32_t(size_ - i)) > lanes() ? predicted : none;
        store(&predicted_[i], predicted);
        least8 = least8 < predicted ? least8 : predicted;
    }
    return least(least8);
}

}  // namespace touchstone
