#include "haptics/qp/pqp_paper.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "haptics/math/simd.hpp"

namespace touchstone {

PaperPqp::PaperPqp(int capacity) : stride_(paddedToEight(std::min(capacity, kMaxRows))) {
    q_.resize(std::size_t(stride_) * stride_);
    for (auto* entries : {&d_, &r_, &y_, &next_}) entries->resize(stride_);
}

/// (17): Q = J G⁻¹ J', and r of (18).
void PaperPqp::form(const QpProblem& problem) {
    const RowSet& rows = *problem.rows;
    m_ = rows.size();
    assert(m_ <= stride_);
    for (int i = 0; i < m_; ++i) {
        const Vec6 j = rows.row(i);
        const Vec6 a = j.cwiseQuotient(problem.stiffness);
        simd::Double8 negative{};
        for (int k = 0; k < m_; k += 8) {
            simd::Double8 q{};
            for (int c = 0; c < 6; ++c) q += a[c] * simd::load(rows.column(c) + k);
            simd::store(&q_[std::size_t(i) * stride_ + k], q);
            negative += simd::max(-q, simd::Double8{});
        }
        d_[i] = -(rows.gap()[i] + j.dot(problem.wanted));
        r_[i] = std::max(q_[std::size_t(i) * stride_ + i], simd::sum(negative));
    }
    for (auto* entries : {&y_, &next_}) std::fill_n(entries->begin(), paddedToEight(m_), 0.0);  // padding stays zero
    std::fill_n(y_.begin(), m_, kStart);
}

/// Puts (18) of y into next_ and returns F(y) of (16).
double PaperPqp::update() {
    double F = 0;
    for (int i = 0; i < m_; ++i) {
        simd::Double8 plus{}, minus{};
        for (int k = 0; k < m_; k += 8) {
            const simd::Double8 q = simd::load(&q_[std::size_t(i) * stride_ + k]), y = simd::load(&y_[k]);
            plus += simd::max(q, simd::Double8{}) * y;
            minus += simd::max(-q, simd::Double8{}) * y;
        }
        const double qPlus = simd::sum(plus), qMinus = simd::sum(minus), r = r_[i] * y_[i];
        F += y_[i] * ((qPlus - qMinus) / 2 - d_[i]);
        next_[i] = y_[i] * ((std::max(d_[i], 0.0) + (qMinus + r)) / (std::max(-d_[i], 0.0) + (qPlus + r)));
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
