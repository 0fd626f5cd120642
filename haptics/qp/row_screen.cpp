#include "haptics/qp/row_screen.hpp"

#include <cassert>

#include "haptics/math/simd.hpp"

namespace touchstone {
namespace {
constexpr double kDecided = std::numeric_limits<double>::infinity();  // rank of a row that was kept or dropped
}

RowScreen::RowScreen(int capacity) : kept_(capacity), rank_(paddedToEight(capacity)), keep_(paddedToEight(capacity)) {}

const RowSet& RowScreen::run(const RowSet& rows, Screening how, double reach, double trust) {
    if (how == Screening::None) return rows;
    const int m = rows.size();
    assert(m <= kept_.capacity());
    const simd::Double8 none = simd::splat(kDecided);

    // The rank of every row, and the first row to keep.
    simd::Double8 least = none, where{};
    const auto trackLeast = [&](int i, const simd::Double8& rank) {
        const simd::Long8 lower = simd::less(rank, least);
        least = simd::choose(lower, rank, least);
        where = simd::choose(lower, simd::splat(double(i)), where);
    };
    for (int i = 0; i < m; i += 8) {
        const simd::Double8 gap = simd::load(rows.gap() + i);
        simd::store(&rank_[i], gap);  // infinite in the padding
        simd::store(&keep_[i], simd::Double8{});
        trackLeast(i, gap);
    }
    const auto lowest = [&] {
        double rank = kDecided;
        int row = -1;
        for (int lane = 0; lane < 8; ++lane) {
            const int candidate = int(where[lane]) + lane;
            if (least[lane] < rank || (least[lane] == rank && row >= 0 && candidate < row)) {
                rank = least[lane];
                row = candidate;
            }
        }
        return row;
    };

    const double shrink = reach > 0 ? 1 / reach : 0;  // a tool of one sphere has no lever
    int passes = 0;
    for (int k = lowest(); k >= 0 && passes < kMaxPasses; k = lowest(), ++passes) {
        keep_[k] = 1;
        rank_[k] = kDecided;
        double a[6], length2 = 0;
        for (int c = 0; c < 6; ++c) {
            a[c] = rows.column(c)[k] * (c < 3 ? 1 : shrink);
            length2 += a[c] * a[c];
        }
        const double gap = rows.gap()[k];
        least = none;
        for (int i = 0; i < m; i += 8) {
            simd::Double8 apart2{}, along{}, size2{};
#pragma GCC unroll 6
            for (int c = 0; c < 6; ++c) {
                const simd::Double8 b = simd::load(rows.column(c) + i) * (c < 3 ? 1 : shrink);
                const simd::Double8 difference = b - a[c];
                apart2 = simd::fma(difference, difference, apart2);
                along = simd::fma(a[c], b, along);
                size2 = simd::fma(b, b, size2);
            }
            const simd::Double8 more = simd::load(rows.gap() + i) - gap;
            const simd::Long8 implied =
                how == Screening::Screen
                    ? simd::atMost(simd::kZeros, more) & simd::atMost(trust * trust * apart2, more * more)
                    : simd::less(simd::kZeros, along) &
                          simd::atMost(kCosine * kCosine * length2 * size2, along * along);
            const simd::Double8 rank = simd::choose(implied, none, simd::load(&rank_[i]));
            simd::store(&rank_[i], rank);
            trackLeast(i, rank);
        }
    }

    kept_.clear();
    for (int i = 0; i < m; ++i) {
        if (keep_[i] > 0 || rank_[i] < kDecided) kept_.push(rows.row(i), rows.gap()[i], rows.id(i));
    }
    return kept_;
}

bool RowScreen::isExact(Screening how, const Vec6& x, double reach, double trust) {
    if (how == Screening::Cluster) return false;
    return how == Screening::None ||
           x.head<3>().squaredNorm() + reach * reach * x.tail<3>().squaredNorm() <= trust * trust;
}

}  // namespace touchstone
