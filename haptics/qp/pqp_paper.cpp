#include "haptics/qp/pqp_paper.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "haptics/math/simd.hpp"

namespace touchstone {

PaperPqp::PaperPqp(int capacity) {
    const std::size_t rows = std::size_t(paddedToEight(std::min(capacity, kMaxRows)));
    q_.resize(rows * rows);
    for (auto* entries : {&d_, &r_, &y_, &next_}) entries->resize(rows);
}

/// Forms Q = J G⁻¹ J' of (17) and r of (18). Q is stored in panels of eight rows, column after column, so that the
/// product of a panel with y reads memory once from front to back and sums eight rows in the lanes of a register.
void PaperPqp::form(const QpProblem& problem) {
    const RowSet& rows = *problem.rows;
    m_ = rows.size();
    const int padded = paddedToEight(m_);
    assert(std::size_t(padded) <= y_.size());
    for (int i = 0; i < padded; i += 8) {
        double* panel = &q_[std::size_t(i) * padded];
        simd::Double8 a[6], negative{}, diagonal{}, d = -simd::load(rows.gap() + i);
        for (int c = 0; c < 6; ++c) {
            const simd::Double8 j = simd::load(rows.column(c) + i);
            a[c] = j / problem.stiffness[c];
            d = simd::fnma(problem.wanted[c], j, d);
        }
        for (int k = 0; k < m_; ++k) {
            simd::Double8 q{};
#pragma GCC unroll 6
            for (int c = 0; c < 6; ++c) q = simd::fma(rows.column(c)[k], a[c], q);
            simd::store(panel + 8 * k, q);
            negative -= simd::min(q, simd::Double8{});
            if (k - i >= 0 && k - i < 8) diagonal[k - i] = q[k - i];
        }
        simd::store(&d_[i], d);
        simd::store(&r_[i], simd::max(diagonal, negative));
    }
    std::fill_n(next_.begin(), padded, 0.0);
    std::fill_n(y_.begin(), padded, 0.0);  // the padding stays zero
    std::fill_n(y_.begin(), m_, kStart);
}

/// Writes the update (18) of y to next_ and returns F(y) of (16).
double PaperPqp::update() {
    const simd::Double8 zero{};
    const int padded = paddedToEight(m_);
    double F = 0;
    for (int i = 0; i < padded; i += 8) {
        const double* panel = &q_[std::size_t(i) * padded];
        simd::Double8 plus[4]{}, minus[4]{};  // four chains hide the latency of the additions
        const auto add = [&](int k, int chain) {
            const simd::Double8 q = simd::load(panel + 8 * k), y = simd::splat(y_[k]);
            plus[chain] = simd::fma(simd::max(q, zero), y, plus[chain]);
            minus[chain] = simd::fnma(simd::min(q, zero), y, minus[chain]);
        };
        int k = 0;
        for (; k + 4 <= m_; k += 4) {
            add(k, 0);
            add(k + 1, 1);
            add(k + 2, 2);
            add(k + 3, 3);
        }
        for (; k < m_; ++k) add(k, 0);
        const simd::Double8 y = simd::load(&y_[i]), d = simd::load(&d_[i]), r = simd::load(&r_[i]) * y;
        const simd::Double8 qPlus = (plus[0] + plus[1]) + (plus[2] + plus[3]),
                            qMinus = (minus[0] + minus[1]) + (minus[2] + minus[3]);
        const simd::Double8 next = y * ((simd::max(d, zero) + (qMinus + r)) / (simd::max(-d, zero) + (qPlus + r)));
        const int rows = std::min(8, m_ - i);
        for (int lane = 0; lane < rows; ++lane) {
            next_[i + lane] = next[lane];
            F += y[lane] * ((qPlus[lane] - qMinus[lane]) / 2 - d[lane]);
        }
    }
    return F;
}

SolveStatus PaperPqp::solve(const QpProblem& problem, const SolverSettings& settings, int& iterations) {
    form(problem);
    const std::int64_t limit =
        std::min<std::int64_t>(settings.maxIterations, settings.workLimit / std::max(1, m_ * m_));
    double last = update();
    for (iterations = 0; iterations < limit;) {
        std::swap(y_, next_);
        ++iterations;
        const double F = update();
        if (!std::isfinite(F)) return SolveStatus::Invalid;
        if (std::abs(F - last) < settings.tolerance) return SolveStatus::Solved;
        last = F;
    }
    return SolveStatus::IterationLimit;
}

}  // namespace touchstone
