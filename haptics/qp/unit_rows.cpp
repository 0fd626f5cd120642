#include "haptics/qp/unit_rows.hpp"

#include "haptics/qp/simd.hpp"

namespace touchstone {

UnitRows::UnitRows(int capacity)
    : offset(paddedToEight(capacity)), inverse(paddedToEight(capacity)), capacity_(capacity) {
    for (auto& entries : column) entries.resize(paddedToEight(capacity));
}

bool UnitRows::assign(const QpProblem& problem) {
    size = problem.rows ? problem.rows->size() : 0;
    hopeless = false;
    wanted = problem.wanted;
    root = problem.stiffness.cwiseSqrt();
    if (size > capacity_ || !wanted.allFinite() || !root.allFinite() || !(root.minCoeff() > 0)) return false;

    constexpr double kShortest2 = 1e-30;
    constexpr Vec8 lanes = {0, 1, 2, 3, 4, 5, 6, 7};
    const Vec6 inverseRoot = root.cwiseInverse();
    Vec8 finite{};
    Mask8 stuck{};
    for (int i = 0; i < size; i += 8) {
        const Vec8 g = load8(problem.rows->gap() + i);
        Vec8 j[6], length2{}, d = g;
        for (int k = 0; k < 6; ++k) {
            const Vec8 entry = load8(problem.rows->column(k) + i);
            d += wanted[k] * entry;
            j[k] = inverseRoot[k] * entry;
            length2 += j[k] * j[k];
        }
        const Mask8 kept = length2 > kShortest2;
        const Vec8 scale = kept ? 1 / sqrt8(length2) : Vec8{};
        for (int k = 0; k < 6; ++k) store8(column[k].data() + i, scale * j[k]);
        store8(offset.data() + i, kept ? scale * d : all8(kNeverMet));
        store8(inverse.data() + i, scale);
        stuck |= ~kept & (g < 0.0);
        finite += (lanes < double(size - i) ? d + length2 : Vec8{}) * 0.0;  // padding is not the caller's
    }
    for (int lane = 0; lane < 8; ++lane) hopeless |= stuck[lane] != 0;
    return sum8(finite) == 0;
}

Vec6 UnitRows::increment(const double* z) const { return wanted + Eigen::Map<const Vec6>(z).cwiseQuotient(root); }

}  // namespace touchstone
