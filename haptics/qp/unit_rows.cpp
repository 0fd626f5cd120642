#include "haptics/qp/unit_rows.hpp"

#include "haptics/math/simd.hpp"

namespace touchstone {

UnitRows::UnitRows(int capacity)
    : offset(paddedToEight(capacity)), inverse(paddedToEight(capacity)), capacity_(capacity) {
    for (auto& entries : column) entries.resize(paddedToEight(capacity));
}

bool UnitRows::assign(const QpProblem& problem) {
    size = problem.rows ? problem.rows->size() : 0;
    unsatisfiable = false;
    wanted = problem.wanted;
    root = problem.stiffness.cwiseSqrt();
    if (size > capacity_ || !wanted.allFinite() || !root.allFinite() || !(root.minCoeff() > 0)) return false;

    constexpr double kNoDirection2 = 1e-30;  // squared length below which a row has no direction
    constexpr simd::Double8 lanes = {0, 1, 2, 3, 4, 5, 6, 7};
    const Vec6 inverseRoot = root.cwiseInverse();
    simd::Double8 finite{};
    simd::Long8 stuck{};
    for (int i = 0; i < size; i += 8) {
        const simd::Double8 g = simd::load(problem.rows->gap() + i);
        simd::Double8 j[6], length2{}, d = g;
        for (int k = 0; k < 6; ++k) {
            const simd::Double8 entry = simd::load(problem.rows->column(k) + i);
            d = simd::fma(wanted[k], entry, d);
            j[k] = inverseRoot[k] * entry;
            length2 = simd::fma(j[k], j[k], length2);
        }
        const simd::Long8 kept = simd::less(simd::splat(kNoDirection2), length2);
        const simd::Double8 scale = simd::choose(kept, 1 / simd::sqrt(length2), simd::kZeros);
        for (int k = 0; k < 6; ++k) simd::store(column[k].data() + i, scale * j[k]);
        simd::store(offset.data() + i, simd::choose(kept, scale * d, simd::splat(kInactive)));
        simd::store(inverse.data() + i, scale);
        stuck |= ~kept & simd::less(g, simd::kZeros);
        finite += simd::choose(simd::less(lanes, simd::splat(double(size - i))), d + length2, simd::kZeros) *
                  0.0;  // the padding does not count
    }
    for (int lane = 0; lane < 8; ++lane) unsatisfiable |= stuck[lane] != 0;
    return simd::sum(finite) == 0;
}

Vec6 UnitRows::increment(const double* z) const { return wanted + Eigen::Map<const Vec6>(z).cwiseQuotient(root); }

}  // namespace touchstone
