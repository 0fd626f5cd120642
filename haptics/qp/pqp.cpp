#include "haptics/qp/pqp.hpp"

#include <algorithm>
#include <cmath>

#include "haptics/math/simd.hpp"
#include "haptics/qp/pqp_paper.hpp"
#include "haptics/qp/unit_rows.hpp"
#include "haptics/qp/warm_start.hpp"

namespace touchstone {
namespace {

/// Lower bound of every force, as a part of the tolerance. A force of zero could never grow again under multiplication;
/// this floor keeps inactive rows able to grow and adds, over 300 of them, less than a thirtieth of the tolerance to
/// the force.
constexpr double kFloor = 1e-4;
constexpr double kSmallestFloor = 1e-12;  // N: lower bound of the floor itself
constexpr double kLargestScale = 1000;    // upper bound of the factor on the start forces, for opposed rows
constexpr double kRunaway = 1e9;          // N: a sum of forces this large belongs to rows that contradict each other

class Pqp final : public Solver {
  public:
    explicit Pqp(int capacity);

    SolveResult solve(const QpProblem& problem, const SolverSettings& settings) noexcept override;
    void reset() noexcept override { lastAnswer_.forget(); }

  private:
    SolveStatus iterate(const RowSet& rows, const SolverSettings& settings, int& iterations);
    void start(const RowSet& rows, double floor);
    void sum(double& slope);
    double update(double momentum, double floor, bool& overshot);

    PaperPqp paper_;

    // With the unit rows B = [b_i], e and u_i = l_i y_i the dual is min F(u) = ½|B'u|² + e'u over u >= 0.
    UnitRows rows_;
    AlignedVector<double> u_;     // where F is evaluated
    AlignedVector<double> next_;  // where F is evaluated next
    AlignedVector<double> step_;  // the end of the last step, before momentum
    AlignedVector<double> y_;     // the answer, N on the rows as given
    Vec6 along_, size_;           // B'u and |B|'u

    AlignedVector<Multiplier> answer_;
    WarmStart lastAnswer_;  // of the robust form
};

Pqp::Pqp(int capacity) : paper_(capacity), rows_(capacity), answer_(capacity), lastAnswer_(capacity) {
    for (auto* entries : {&u_, &next_, &step_, &y_}) entries->resize(paddedToEight(capacity));
}

/// Starts from the last answer's forces for contacts that still exist and from the paper's start for new ones. All are
/// scaled by the one factor that minimizes F, since a thousandth of a newton on each of thousands of rows would push
/// the tool away.
void Pqp::start(const RowSet& rows, double floor) {
    std::fill_n(u_.begin(), paddedToEight(rows_.size), 0.0);
    WarmStart::ForceLookup last(lastAnswer_);
    for (int i = 0; i < rows_.size; ++i) {
        if (rows_.inverse[i] == 0) continue;
        u_[i] = last.forceOf(rows.id(i), PaperPqp::kStart) / rows_.inverse[i];
    }
    double slope = 0;
    sum(slope);
    // The minimum of F(scale u) = ½ scale² |B'u|² + scale e'u; opposed rows may have none.
    const double scale = std::min(std::max(0.0, -slope / along_.squaredNorm()), kLargestScale);
    for (int i = 0; i < rows_.size; ++i) u_[i] = rows_.inverse[i] > 0 ? std::max(floor, scale * u_[i]) : 0;
    std::copy_n(u_.begin(), paddedToEight(rows_.size), step_.begin());
    sum(slope);
}

/// B'u, |B|'u and e'u.
void Pqp::sum(double& slope) {
    simd::Double8 along[6]{}, size[6]{}, down{};
    for (int i = 0; i < rows_.size; i += 8) {
        const simd::Double8 u = simd::load(&u_[i]);
        down = simd::fma(u, simd::load(&rows_.offset[i]), down);
        for (int k = 0; k < 6; ++k) {
            const simd::Double8 b = simd::load(&rows_.column[k][i]);
            along[k] = simd::fma(u, b, along[k]);
            size[k] = simd::fma(u, simd::abs(b), size[k]);
        }
    }
    slope = simd::sum(down);
    for (int k = 0; k < 6; ++k) {
        along_[k] = simd::sum(along[k]);
        size_[k] = simd::sum(size[k]);
    }
}

/// One update of every force: (18) without forming Q. B = B+ - B-, its positive and negative entries, splits Q into
///   Q+ = B+B+' + B-B-'   and   Q- = B+B-' + B-B+',   so that   2 Q±u = |B| (|B|'u) ± B (B'u).
/// With r_i u_i = (Q+u)_i the update is a descent step, u' = u - (u/D) ∇F with D = d- + 2 Q+u. Proof that F falls: Q+
/// and Q+ + Q- = |B||B|' are positive semidefinite, so Q = Q+ - Q- <= 2Q+ <= diag(2 Q+u / u) <= diag(D/u), the second
/// step because Q+ has no negative entry; hence F(u') <= F(u) - ½ Σ (D/u)(u'-u)². The paper's r is larger where rows
/// oppose each other. r = 0 is also monotone but leaves no room for momentum; with momentum it was seen to cycle.
/// Returns max_i |min(y_i, s_i/q_i)| of the u it starts from, which stays in next_.
double Pqp::update(double momentum, double floor, bool& overshot) {
    simd::Double8 along[6]{}, size[6]{}, residual{}, uphill{};
    for (int i = 0; i < rows_.size; i += 8) {
        simd::Double8 b[6], ahead{}, around{};
#pragma GCC unroll 6
        for (int k = 0; k < 6; ++k) {
            b[k] = simd::load(&rows_.column[k][i]);
            ahead = simd::fma(along_[k], b[k], ahead);
            around = simd::fma(size_[k], simd::abs(b[k]), around);
        }
        const simd::Double8 e = simd::load(&rows_.offset[i]), inverse = simd::load(&rows_.inverse[i]),
                            u = simd::load(&u_[i]);
        const simd::Double8 gap = ahead + e;  // s_i / l_i, the gradient of F
        residual = simd::max(simd::abs(simd::min(gap, u)) * inverse, residual);

        const simd::Double8 plus =
            simd::max((around + ahead) * 0.5, u);  // (Q+u)_i >= u_i because |b_i| = 1; rounding must not break this
        const simd::Double8 minus = simd::max((around - ahead) * 0.5, simd::Double8{});
        const simd::Double8 least = simd::choose(simd::less(simd::kZeros, inverse), simd::splat(floor), simd::kZeros);
        const simd::Double8 end = simd::max(
            u * ((simd::max(-e, simd::Double8{}) + minus + plus) / (simd::max(e, simd::Double8{}) + plus + plus)),
            least);
        const simd::Double8 stride = end - simd::load(&step_[i]);
        uphill = simd::fma(gap, stride, uphill);
        simd::store(&step_[i], end);
        const simd::Double8 next = simd::max(simd::fma(momentum, stride, end), least);
        simd::store(&next_[i], next);
#pragma GCC unroll 6
        for (int k = 0; k < 6; ++k) {
            along[k] = simd::fma(next, b[k], along[k]);
            size[k] = simd::fma(next, simd::abs(b[k]), size[k]);
        }
    }
    for (int k = 0; k < 6; ++k) {
        along_[k] = simd::sum(along[k]);
        size_[k] = simd::sum(size[k]);
    }
    std::swap(u_, next_);
    overshot = simd::sum(uphill) > 0;
    return -simd::least(-residual);
}

/// Updates with Nesterov's momentum, restarted when a step goes uphill (O'Donoghue and Candès 2015). It pays: on
/// sliding, wedged, pinched and degenerate contacts of 200 rows, from a cold start, the median number of iterations
/// with momentum and of the plain update with r = 0 was 56 and 193 at 1e-2 N, 121 and 1,291 at 1e-3 N, 200 and 3,929 at
/// 1e-4 N. At 1e-4 N a sixth of the plain runs took more than 20,000 iterations, and none with momentum did. An
/// iteration costs about the same.
SolveStatus Pqp::iterate(const RowSet& rows, const SolverSettings& settings, int& iterations) {
    const std::int64_t limit =
        std::min<std::int64_t>(settings.maxIterations, settings.workLimit / std::max(1, rows_.size));
    const double floor = std::max(kSmallestFloor, kFloor * settings.tolerance);
    start(rows, floor);
    double pace = 1;
    for (iterations = 0;; ++iterations) {
        const double nextPace = (1 + std::sqrt(1 + 4 * pace * pace)) / 2;
        bool overshot = false;
        if (!(size_.maxCoeff() < kRunaway)) return SolveStatus::IterationLimit;
        const Vec6 along = along_;
        const double residual = update((pace - 1) / nextPace, floor, overshot);
        if (residual < settings.tolerance || iterations >= limit) {
            std::swap(u_, next_);  // back to the forces that the residual belongs to
            along_ = along;
            return residual < settings.tolerance ? SolveStatus::Solved : SolveStatus::IterationLimit;
        }
        pace = overshot ? 1 : nextPace;
    }
}

SolveResult Pqp::solve(const QpProblem& problem, const SolverSettings& settings) noexcept {
    SolveResult result;
    if (!rows_.assign(problem) || (settings.paperForm && rows_.size > PaperPqp::kMaxRows)) return result;
    const int m = rows_.size;
    if (m == 0) {
        result.status = SolveStatus::Solved;
        result.x = problem.wanted;
        return result;
    }

    const double* y = nullptr;
    if (settings.paperForm) {
        result.status = paper_.solve(problem, settings, result.iterations);
        y = paper_.y();
        Vec6 force = Vec6::Zero();
        for (int i = 0; i < m; ++i) force += y[i] * problem.rows->row(i);
        result.x = problem.wanted + force.cwiseQuotient(problem.stiffness);  // (19), (20)
    } else {
        result.status = iterate(*problem.rows, settings, result.iterations);
        for (int i = 0; i < m; ++i) y_[i] = u_[i] * rows_.inverse[i];
        y = y_.data();
        result.x = rows_.increment(along_.data());
        if (result.status == SolveStatus::Solved && rows_.unsatisfiable) result.status = SolveStatus::Elastic;
    }
    if (result.status == SolveStatus::Invalid || !result.x.allFinite()) {
        lastAnswer_.forget();
        const int iterations = result.iterations;
        result = SolveResult();
        result.iterations = iterations;
        return result;
    }

    int pushing = 0;
    for (int i = 0; i < m; ++i) {
        if (y[i] > 0) answer_[pushing++] = {i, y[i]};
    }
    result.multipliers = {answer_.data(), std::size_t(pushing)};
    result.kkt = kktResiduals(problem, result.x, result.multipliers);
    if (!settings.paperForm) {
        lastAnswer_.forget();
        for (int i = 0; i < m; ++i) lastAnswer_.remember(problem.rows->id(i), y[i]);
    }
    return result;
}

}  // namespace

std::unique_ptr<Solver> makePqp(int capacity) { return std::make_unique<Pqp>(capacity); }

}  // namespace touchstone
