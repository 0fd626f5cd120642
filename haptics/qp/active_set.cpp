#include "haptics/qp/active_set.hpp"

#include <algorithm>
#include <cmath>

#include "haptics/qp/basis.hpp"
#include "haptics/qp/unit_rows.hpp"
#include "haptics/qp/warm_start.hpp"

namespace touchstone {
namespace {

// Lengths are in the metric of G (UnitRows). Relative ones are multiplied by 1 + |z| or 1 + |z| + cost.
constexpr double kNoStep = 1e-12;    // relative: a shorter step counts as zero, so the working set's optimum is reached
constexpr double kParallel = 1e-11;  // of the step: a row that is approached by less does not block the step
constexpr double kStepNoise = 1e-14;  // relative: added to kParallel, so that rounding alone does not block a step
constexpr double kPull = 1e-11;       // relative: a multiplier above minus this does not count as negative
constexpr double kTouching = 1e-10;   // rows this near may be held from the start; answers are feasible to this
constexpr double kFeasibleAfterTies = 1e-12;  // feasibility after a perturbation, when another vertex may be found
constexpr double kIndependent2 = 1e-12;      // squared sine of a row's angle to the span of the held rows, at the start
constexpr double kDependent2 = 1e-26;        // the same bound later: a smaller value is rounding
constexpr int kStalledSteps = 10;            // steps without progress before the rows are perturbed
constexpr double kPerturbation = 1e-9;       // each plane then moves back by 1 to 2 times this, so that no tie remains
constexpr double kPenalties[] = {1e3, 1e6};  // M of phase 1, N: larger than the sum of forces in any contact

/// In the metric of G (UnitRows): min ½|z|² + cost z6 s.t. b_i·z + slack z6 + e_i >= 0 and, where slack > 0, z6 >= 0.
/// Lanes 0..5 of z are the increment; z6 stays zero while slack and cost are zero.
class ActiveSet final : public Solver {
  public:
    explicit ActiveSet(int capacity) : rows_(capacity) {}

    SolveResult solve(const QpProblem& problem, const SolverSettings& settings) noexcept override;
    void reset() noexcept override { lastActive_.forget(); }

  private:
    struct Block {
        double fraction = 1;  ///< of the step that can be taken
        int row = -1;         ///< the row that blocks the rest; -1: none
    };

    bool hold(int row, double independent2);
    void release(int j);
    void holdLastActive(const RowSet& rows);
    simd::Double8 heldOptimum();
    Block firstBlock(const simd::Double8& step) const;
    double leastGap(const simd::Double8& z) const;
    void perturb(double sign);
    bool walk();
    bool makeFeasible();
    void fill(const QpProblem& problem, SolveResult& result);

    UnitRows rows_;
    double slack_ = 0, cost_ = 0;
    simd::Double8 z_{};
    int steps_ = 0, limit_ = 0;
    bool perturbed_ = false;

    ActiveBasis held_;                     // the working set: rows held as equations
    int working_[ActiveBasis::kMax] = {};  // their indices; rows_.size is the bound z6 >= 0
    simd::Double8 forces_{};               // their multipliers at heldOptimum()

    WarmStart lastActive_{ActiveBasis::kMax};
    Multiplier answer_[ActiveBasis::kMax];
};

double norm(const simd::Double8& a) { return std::sqrt(simd::sum(a * a)); }

bool ActiveSet::hold(int row, double independent2) {
    const bool bound = row == rows_.size;
    simd::Double8 n{};
    for (int k = 0; k < 6; ++k) n[k] = bound ? 0 : rows_.column[k][row];
    n[6] = bound ? 1 : slack_;
    const ActiveBasis::Split split = held_.split(n);
    if (held_.size() == ActiveBasis::kMax || !(split.across2 > independent2)) return false;
    working_[held_.size()] = row;
    held_.append(n, bound ? 0 : rows_.offset[row], split);
    return true;
}

void ActiveSet::release(int j) {
    held_.drop(j);
    std::copy(working_ + j + 1, working_ + held_.size() + 1, working_ + j);
}

/// Holds those rows of the last answer that touch at the point where the walk begins.
void ActiveSet::holdLastActive(const RowSet& rows) {
    lastActive_.forEachRow(rows, [&](int row) {
        if (rows_.inverse[row] == 0) return true;
        double gap = rows_.offset[row];
        for (int c = 0; c < 6; ++c) gap += rows_.column[c][row] * z_[c];
        if (std::abs(gap) <= kTouching) hold(row, kIndependent2);
        return true;
    });
}

/// The optimum with the working set as equations, and its multipliers. The planes of the held rows fix the part of z in
/// their span; the rest equals that of the free optimum (0, ..., 0, -cost).
simd::Double8 ActiveSet::heldOptimum() {
    simd::Double8 free{};
    free[6] = -cost_;
    const ActiveBasis::Split split = held_.split(free);
    forces_ = held_.multipliers() - split.weights;
    return held_.nearest() + split.across;
}

/// The fraction of the step that stays feasible, and the row that blocks the rest; the lowest row of several.
ActiveSet::Block ActiveSet::firstBlock(const simd::Double8& step) const {
    const double parallel = -kParallel * norm(step) - kStepNoise * (1 + norm(z_));
    simd::Double8 least = simd::splat(1.0), where = simd::splat(-1.0);
    for (int i = 0; i < rows_.size; i += 8) {
        simd::Double8 approach = simd::splat(slack_ * step[6]), gap = simd::load(&rows_.offset[i]) + slack_ * z_[6];
        for (int k = 0; k < 6; ++k) {
            const simd::Double8 b = simd::load(&rows_.column[k][i]);
            approach = simd::fma(step[k], b, approach);
            gap = simd::fma(z_[k], b, gap);
        }
        const simd::Double8 fraction = simd::max(gap, simd::Double8{}) / -approach;
        const simd::Long8 nearer = simd::less(approach, simd::splat(parallel)) & simd::less(fraction, least);
        least = simd::choose(nearer, fraction, least);
        where = simd::choose(nearer, simd::splat(double(i)), where);
    }
    Block block;
    for (int lane = 0; lane < 8; ++lane) {
        const int row = int(where[lane]) + lane;
        if (where[lane] < 0) continue;
        if (least[lane] < block.fraction || (least[lane] == block.fraction && row < block.row))
            block = {least[lane], row};
    }
    if (slack_ > 0 && step[6] < parallel && -z_[6] / step[6] < block.fraction) {
        block = {-z_[6] / step[6], rows_.size};
    }
    return block;
}

double ActiveSet::leastGap(const simd::Double8& z) const {
    simd::Double8 least{};
    for (int i = 0; i < rows_.size; i += 8) {
        simd::Double8 gap = simd::load(&rows_.offset[i]) + slack_ * z[6];
        for (int k = 0; k < 6; ++k) gap = simd::fma(z[k], simd::load(&rows_.column[k][i]), gap);
        least = simd::min(gap, least);
    }
    return simd::least(least);
}

/// Moves every plane back by a small amount that differs from plane to plane (sign 1), or undoes this (sign -1). This
/// breaks the ties of degenerate vertices, at which the walk could cycle.
void ActiveSet::perturb(double sign) {
    perturbed_ = sign > 0;
    for (int i = 0; i < rows_.size; ++i) {
        const double golden = 0.6180339887498949 * (i + 1);
        rows_.offset[i] += sign * kPerturbation * (1 + golden - std::floor(golden));
    }
}

/// Algorithm 16.3, started from z_, which must be feasible. Returns false if the step limit ends it.
bool ActiveSet::walk() {
    for (int stalled = 0; steps_ < limit_; ++steps_) {
        if (stalled > kStalledSteps && !perturbed_) {
            perturb(1);
            held_.clear();
        }
        const simd::Double8 optimum = heldOptimum();
        const simd::Double8 step = optimum - z_;
        if (norm(step) <= kNoStep * (1 + norm(z_) + cost_)) {
            z_ = optimum;
            const double pull = -kPull * (1 + norm(z_) + cost_);
            int weakest = -1;
            for (int j = 0; j < held_.size(); ++j) {
                if (forces_[j] < pull && (weakest < 0 || forces_[j] < forces_[weakest])) weakest = j;
            }
            if (weakest < 0) return true;
            release(weakest);
            continue;
        }
        const Block block = firstBlock(step);
        z_ += block.fraction * step;
        stalled = block.fraction * norm(step) > kNoStep ? 0 : stalled + 1;
        if (block.row >= 0) hold(block.row, kDependent2);
    }
    return false;
}

/// Phase 1. Returns false if the rows contradict each other or the step limit ends it.
bool ActiveSet::makeFeasible() {
    z_[6] = -leastGap(z_);
    if (z_[6] <= kTouching) {
        z_[6] = 0;
        return true;
    }
    held_.clear();
    slack_ = 1;
    for (const double penalty : kPenalties) {
        cost_ = penalty;
        if (!walk()) return false;
        if (z_[6] <= kTouching) break;
    }
    if (z_[6] > kTouching) return false;
    // Rows that were held together with the bound z6 = 0 stay independent without the slack and are kept. If the bound
    // was not held, phase 2 finds its working set itself.
    int rows[ActiveBasis::kMax];
    const int* end = std::remove_copy(working_, working_ + held_.size(), rows, rows_.size);
    const bool bounded = end - rows < held_.size();
    held_.clear();
    slack_ = cost_ = z_[6] = 0;
    if (bounded) std::for_each<const int*>(rows, end, [&](int row) { hold(row, kIndependent2); });
    return true;
}

void ActiveSet::fill(const QpProblem& problem, SolveResult& result) {
    alignas(64) double z[8];
    simd::store(z, z_);
    result.x = rows_.increment(z);
    result.iterations = steps_;
    result.slack = slack_ * z_[6];
    int pushing = 0;
    lastActive_.forget();
    for (int j = 0; j < held_.size(); ++j) {
        const int row = working_[j];
        if (row == rows_.size) continue;
        const double force = forces_[j] * rows_.inverse[row];
        lastActive_.remember(problem.rows->id(row), force);
        if (forces_[j] > 0) answer_[pushing++] = {row, force};
    }
    result.multipliers = {answer_, std::size_t(pushing)};
    result.kkt = kktResiduals(problem, result.x, result.multipliers);
}

SolveResult ActiveSet::solve(const QpProblem& problem, const SolverSettings& settings) noexcept {
    SolveResult result;
    if (!rows_.assign(problem)) return result;
    const int m = rows_.size;
    if (m == 0) {
        result.status = SolveStatus::Solved;
        result.x = problem.wanted;
        return result;
    }
    limit_ = int(std::min<std::int64_t>({10 * m + 100, settings.maxIterations, settings.workLimit / m}));
    steps_ = 0;
    perturbed_ = false;
    held_.clear();
    slack_ = cost_ = 0;
    z_ = simd::Double8{};
    for (int k = 0; k < 6; ++k) z_[k] = -rows_.root[k] * rows_.wanted[k];  // x = 0
    holdLastActive(*problem.rows);

    bool done = false, contradiction = false;
    if (makeFeasible()) {
        done = walk();
    } else if (steps_ < limit_) {
        contradiction = true;
        held_.clear();
        cost_ = 0;
        slack_ = 1 / std::sqrt(settings.elasticWeight);
        z_[6] /= slack_;
        done = walk();
    }
    const bool tied = perturbed_;
    if (done && tied) {  // solve once more with the same working set on the true planes
        perturb(-1);
        int rows[ActiveBasis::kMax];
        const int count = held_.size();
        std::copy_n(working_, count, rows);
        held_.clear();
        for (int j = 0; j < count; ++j) hold(rows[j], kDependent2);
        z_ = heldOptimum();
        for (int j = 0; j < count; ++j) done &= forces_[j] >= 0;
    }
    const double depth = -leastGap(simd::Double8{});  // of h
    const bool feasible = leastGap(z_) >= -(tied ? kFeasibleAfterTies : kTouching) * (1 + depth);
    result.status = !done || !feasible                     ? SolveStatus::IterationLimit
                    : contradiction || rows_.unsatisfiable ? SolveStatus::Elastic
                                                           : SolveStatus::Solved;
    fill(problem, result);
    return result;
}

}  // namespace

std::unique_ptr<Solver> makeActiveSet(int capacity) { return std::make_unique<ActiveSet>(capacity); }

}  // namespace touchstone
