#include "haptics/qp/problem.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "haptics/math/simd.hpp"

namespace touchstone {

RowSet::RowSet(int capacity) : capacity_(capacity), ids_(paddedToEight(capacity) + 8) {
    assert(capacity >= 0);
    for (auto& column : columns_) column.resize(paddedToEight(capacity) + 8);
}

Vec6 RowSet::row(int i) const {
    Vec6 j;
    for (int k = 0; k < 6; ++k) j[k] = columns_[k][i];
    return j;
}

void RowSet::push(const Vec6& j, double gap, std::uint64_t id) {
    assert(size_ < capacity_);
    const int i = size_;
    if (i % 8 == 0) setSize(i + 1);  // pads the block of eight that begins with row i
    size_ = i + 1;
    for (int k = 0; k < 6; ++k) columns_[k][i] = j[k];
    columns_[6][i] = gap;
    ids_[i] = id;
}

void RowSet::setSize(int n) {
    assert(n >= 0 && n <= capacity_);
    size_ = n;
    // Eight at once, of which some may be behind the block: each column has room for eight more.
    for (int k = 0; k < 6; ++k) simd::store(&columns_[k][std::size_t(n)], simd::kZeros);
    simd::store(&columns_[6][std::size_t(n)], simd::splat(std::numeric_limits<double>::infinity()));
}

void RowSet::erase(int i) {
    assert(i >= 0 && i < size_);
    for (auto& column : columns_) std::copy(column.begin() + i + 1, column.begin() + size_, column.begin() + i);
    std::copy(ids_.begin() + i + 1, ids_.begin() + size_, ids_.begin() + i);
    setSize(size_ - 1);
}

void RowSet::merge(const RowSet& other) {
    int a = size_, b = other.size_;
    setSize(a + b);
    for (int to = size_ - 1; b > 0; --to) {  // from the end, so that no row is overwritten before it has moved
        const bool own = a > 0 && ids_[a - 1] > other.ids_[b - 1];
        const RowSet& from = own ? *this : other;
        const int i = own ? --a : --b;
        for (int k = 0; k < 7; ++k) columns_[k][to] = from.columns_[k][i];
        ids_[to] = from.ids_[i];
    }
}

int RowSet::find(std::uint64_t id) const {
    if (size_ == 0) return -1;
    const std::uint64_t* first = ids_.data();
    for (int n = size_; n > 1;) {  // bisects without a branch to mispredict: the last id <= the wanted one
        const int half = n / 2;
        first += first[half] <= id ? half : 0;
        n -= half;
    }
    return *first == id ? int(first - ids_.data()) : -1;
}

const char* name(SolveStatus status) {
    switch (status) {
        case SolveStatus::Solved:
            return "solved";
        case SolveStatus::Elastic:
            return "elastic";
        case SolveStatus::IterationLimit:
            return "iteration-limit";
        case SolveStatus::Invalid:
            return "invalid";
    }
    return "";
}

KktResiduals kktResiduals(const QpProblem& problem, const Vec6& x, std::span<const Multiplier> multipliers,
                          double leastGap) {
    KktResiduals kkt;
    kkt.primal_mm = std::max(0.0, -leastGap);
    Vec6 residual = problem.stiffness.cwiseProduct(x - problem.wanted);
    for (const Multiplier& multiplier : multipliers) {
        const Vec6 j = problem.rows->row(multiplier.row);
        const double s = j.dot(x) + problem.rows->gap()[multiplier.row];
        residual -= multiplier.value * j;
        kkt.dual_N = std::max(kkt.dual_N, -multiplier.value);
        kkt.complementarity_mJ = std::max(kkt.complementarity_mJ, std::abs(multiplier.value * s));
    }
    // Torques are divided by the lever at which the two springs are equally stiff.
    const double lever2 = problem.stiffness.tail<3>().sum() / problem.stiffness.head<3>().sum();
    kkt.stationarity_N = std::sqrt(residual.head<3>().squaredNorm() + residual.tail<3>().squaredNorm() / lever2);
    return kkt;
}

KktResiduals kktResiduals(const QpProblem& problem, const Vec6& x, std::span<const Multiplier> multipliers) {
    simd::Double8 least{};
    for (int i = 0, m = problem.rows ? problem.rows->size() : 0; i < m; i += 8) {
        simd::Double8 s = simd::load(problem.rows->gap() + i);
        for (int k = 0; k < 6; ++k) s = simd::fma(x[k], simd::load(problem.rows->column(k) + i), s);
        least = simd::min(s, least);
    }
    return kktResiduals(problem, x, multipliers, simd::least(least));
}

WrenchError wrenchError(const QpProblem& problem, const Vec6& x, const Vec6& exact) {
    const Vec6 error = problem.stiffness.cwiseProduct(x - exact);
    return {error.head<3>().norm(), error.tail<3>().norm()};
}

}  // namespace touchstone
