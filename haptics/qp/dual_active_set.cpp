#include "haptics/qp/dual_active_set.hpp"

#include <algorithm>
#include <cmath>

#include "haptics/math/aligned.hpp"
#include "haptics/qp/basis.hpp"
#include "haptics/qp/warm_start.hpp"

namespace touchstone {
namespace {

// Violations are lengths in the metric of G (UnitRows); most are multiplied by 1 + the depth of h under the rows.
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kPivotCap = 400;               // the maximum seen in 100,000 random contacts is 58
constexpr double kFeasible = 1e-14;          // relative: a violation up to this is accepted
constexpr double kFeasibleLate = 1e-12;      // relative: the same after kManyPivots, when planes differ by rounding
constexpr int kManyPivots = 100;             // pivots after which kFeasibleLate applies
constexpr double kNearlyFeasible = 1e-10;    // relative: a larger violation without a way out is a contradiction
constexpr double kDependent = 1e-26;         // |across|² below this is rounding: the row lies in the active rows' span
constexpr double kLastBits = 4e-16;          // relative error of a sum in double precision, about two last bits
constexpr double kWarmIndependent = 1e-12;   // |across|² that a row of the warm start needs; a pivot accepts less
constexpr double kSmallestWeight = 1e-12;    // relative: a smaller weight is rounding, and its row does not block
constexpr double kLargestForce = 1e10;       // relative: rows that need larger forces count as a contradiction
constexpr int kRefinements = 2;              // rounds of iterative refinement
constexpr double kSettled = 1e-10;           // residual accepted after them, times 1 + depth + 1e-6 of the forces
constexpr double kAmplified = 1e4;           // amplification of rounding errors from which a refinement pays
constexpr double kDoubtfulViolation = 1e-3;  // relative: a smaller violation may be an error of z alone
constexpr double kAbsurdStep = 100;          // times the forces: a step this long is a result of rounding
constexpr double kShortest2 = 1e-30;         // squared length below which a row has no direction

enum class Outcome { Optimal, Contradiction, PivotCap, Unsettled, Invalid };

class DualActiveSet final : public Solver {
  public:
    explicit DualActiveSet(int capacity) : capacity_(capacity), inverseLengths_(paddedToEight(capacity)) {}

    SolveResult solve(const QpProblem& problem, const SolverSettings& settings) noexcept override;
    void reset() noexcept override { lastActive_.forget(); }

  private:
    struct Plane {
        simd::Double8 n;  // of unit length in the metric of G; lane 6 is the share of the elastic slack
        double d;         // n·z + d >= 0
        double inverse;   // 1 / length of the row; 0 if it has no direction
    };
    /// The result of one pass over all rows.
    struct Scan {
        double least = kInfinity;  // least n·z + d
        int row = -1;              // the row that has it
        double gap = kInfinity;    // least J x + g
    };

    Plane plane(int row) const;
    template <bool first>
    Scan scan();
    void start();
    void place();
    void drop(int j);
    bool holds(int row) const { return std::find(rows_, rows_ + basis_.size(), row) != rows_ + basis_.size(); }
    Outcome pivot(int limit);
    Outcome run(double slackPerRow, int limit);
    bool isAmplified() const { return basis_.largestInverse() * (1 + basis_.largestHeight()) > kAmplified; }
    bool refine();
    void fill(SolveResult& result);

    const int capacity_;
    AlignedVector<double> inverseLengths_;

    // The present problem.
    const QpProblem* problem_ = nullptr;
    int m_ = 0;
    simd::Double8 wanted_{}, inverseRoot_{};  // h and 1/√G: x = h + inverseRoot_ z
    double slackPerRow_ = 0;                  // 1/√w in the elastic problem, else 0
    bool measured_ = false;                   // depth_, unsatisfiable_ and inverseLengths_ are those of this problem
    double depth_ = 0;                        // of h under the rows
    bool unsatisfiable_ = false;              // a row has no direction and g < 0

    // The state: z is the point of the active rows' planes nearest to the origin, or lies between two such points.
    ActiveBasis basis_;
    int rows_[ActiveBasis::kMax] = {};
    simd::Double8 z_{}, forces_{};  // forces_: the active rows' multipliers, on unit rows
    double leastGap_ = 0;           // least J x + g at z_
    int pivots_ = 0;
    bool settled_ = true;  // the last refinement of z_ converged
    Multiplier entering_;  // a row that counts as satisfied but stays out of the basis, see pivot()

    WarmStart lastActive_{ActiveBasis::kMax};
    Multiplier answer_[ActiveBasis::kMax + 1];
};

DualActiveSet::Plane DualActiveSet::plane(int row) const {
    simd::Double8 j{};
    for (int k = 0; k < 6; ++k) j[k] = problem_->rows->column(k)[row];
    Plane p;
    p.n = j * inverseRoot_;
    const double length2 = simd::sum(p.n * p.n);
    p.inverse = length2 > kShortest2 ? 1 / std::sqrt(length2) : 0;
    p.n *= p.inverse;
    p.n[6] = slackPerRow_;
    p.d = (simd::sum(j * wanted_) + problem_->rows->gap()[row]) * p.inverse;
    return p;
}

/// Finds the row that z violates most. The first scan of a problem also measures the rows' lengths and the depth of h.
/// `least` is NaN if a row is not finite.
template <bool first>
DualActiveSet::Scan DualActiveSet::scan() {
    const RowSet& rows = *problem_->rows;
    const simd::Double8 x = simd::fma(inverseRoot_, z_, wanted_);
    const simd::Double8 metric = inverseRoot_ * inverseRoot_;
    const double slack = slackPerRow_ * z_[6];
    constexpr simd::Double8 lanes = {0, 1, 2, 3, 4, 5, 6, 7};

    simd::Double8 least = simd::splat(kInfinity), gap = least, depth{}, finite{}, where{};
    simd::Long8 unsatisfiable{};
    for (int i = 0; i < m_; i += 8) {
        // s = J x + g of eight rows.
        const simd::Double8 g = simd::load(rows.gap() + i);
        simd::Double8 j[6];
        simd::Double8 s = g;
#pragma GCC unroll 6
        for (int k = 0; k < 6; ++k) {
            j[k] = simd::load(rows.column(k) + i);
            s = simd::fma(x[k], j[k], s);
        }
        simd::Double8 inverse;
        if constexpr (first) {
            // Their lengths in the metric of G, and d = J h + g.
            simd::Double8 length2{}, d = g;
#pragma GCC unroll 6
            for (int k = 0; k < 6; ++k) {
                length2 = simd::fma(metric[k], j[k] * j[k], length2);
                d = simd::fma(wanted_[k], j[k], d);
            }
            inverse = simd::choose(simd::less(simd::splat(kShortest2), length2), 1 / simd::sqrt(length2), simd::kZeros);
            simd::store(inverseLengths_.data() + i, inverse);
            const simd::Double8 scaled = d * inverse;
            depth = simd::min(scaled, depth);
            unsatisfiable |= simd::atMost(inverse, simd::kZeros) & simd::less(g, simd::kZeros);
            finite += simd::choose(simd::less(lanes, simd::splat(double(m_ - i))), d + length2, simd::kZeros) *
                      0.0;  // the padding does not count
        } else {
            inverse = simd::load(inverseLengths_.data() + i);
        }
        // The violation on unit rows, and the least of each lane.
        gap = simd::min(s, gap);
        s = simd::fma(s, inverse, simd::splat(slack));
        const simd::Long8 lower = simd::less(s, least);
        least = simd::choose(lower, s, least);
        where = simd::choose(lower, simd::splat(double(i)), where);
    }

    if constexpr (first) {
        measured_ = true;
        depth_ = -simd::least(depth);
        unsatisfiable_ = false;
        for (int lane = 0; lane < 8; ++lane) unsatisfiable_ |= unsatisfiable[lane] != 0;
    }
    // The least of the lanes.
    Scan result;
    result.gap = simd::least(gap);
    for (int lane = 0; lane < 8; ++lane) {
        const int row = int(where[lane]) + lane;
        // The lower row wins a tie, so that the answer does not depend on the width of a register.
        if (least[lane] < result.least || (least[lane] == result.least && row < result.row)) {
            result.least = least[lane];
            result.row = row;
        }
    }
    if (first && simd::sum(finite) != 0) result.least = simd::sum(finite);
    return result;
}

/// Warm start: takes the planes of the last answer's active contacts that still have rows, and drops planes until the
/// rest all push.
void DualActiveSet::start() {
    basis_.clear();
    const int dimensions = slackPerRow_ > 0 ? 7 : 6;
    lastActive_.forEachRow(*problem_->rows, [&](int row) {
        const Plane p = plane(row);
        const ActiveBasis::Split split = basis_.split(p.n);
        if (p.inverse == 0 || !(split.across2 > kWarmIndependent)) return true;
        rows_[basis_.size()] = row;
        basis_.append(p.n, p.d, split);
        return basis_.size() < dimensions;
    });
    for (place(); basis_.size() > 0; place()) {
        int weakest = 0;
        for (int j = 1; j < basis_.size(); ++j) {
            if (forces_[j] < forces_[weakest]) weakest = j;
        }
        if (forces_[weakest] >= 0) break;
        drop(weakest);
    }
}

void DualActiveSet::place() {
    settled_ = true;
    z_ = basis_.nearest();
    forces_ = basis_.multipliers();
}

void DualActiveSet::drop(int j) {
    basis_.drop(j);
    for (int i = j; i < basis_.size(); ++i) {
        rows_[i] = rows_[i + 1];
        forces_[i] = forces_[i + 1];
    }
    forces_[basis_.size()] = 0;
}

/// Goldfarb and Idnani's method, started from any active rows that all push.
Outcome DualActiveSet::pivot(int limit) {
    for (;;) {
        Scan worst = measured_ ? scan<false>() : scan<true>();
        // Planes that nearly coincide give z an error of their condition number times the last bit. A row that is
        // violated by no more than this error must not decide: pivots on it would end in a false contradiction.
        if (worst.least > -kDoubtfulViolation * (1 + depth_) && isAmplified()) {
            settled_ = refine();
            worst = scan<false>();
        }
        leastGap_ = worst.gap;
        if (std::isnan(worst.least)) return Outcome::Invalid;
        const double accepted = pivots_ < kManyPivots ? kFeasible : kFeasibleLate;
        if (worst.least >= -accepted * (1 + depth_) || holds(worst.row)) return Outcome::Optimal;
        if (pivots_ >= limit) return Outcome::PivotCap;

        // Step toward the plane of the worst row. Each step but the last drops an active row.
        const Plane p = plane(worst.row);
        double force = 0;  // of the entering row
        for (bool entered = false; !entered;) {
            ++pivots_;
            const ActiveBasis::Split split = basis_.split(p.n);
            // The part across the active rows is a difference, so its error is the last bits of what was subtracted.
            const double blur = kLastBits * simd::sum(simd::abs(split.weights));
            const bool dependent =
                split.across2 < std::max(kDependent, blur * blur) || basis_.size() == ActiveBasis::kMax;
            const double violation = -simd::sum(p.n * z_) - p.d;
            const double full = dependent ? kInfinity : violation / split.across2;

            // How far the force can grow before an active row would pull.
            const double largest = simd::largest(simd::abs(split.weights));
            const double noise = kSmallestWeight * std::max(1.0, largest);
            double partial = kInfinity;
            int blocking = -1;
            for (int j = 0; j < basis_.size(); ++j) {
                if (split.weights[j] <= noise) continue;
                const double step = std::max(0.0, forces_[j]) / split.weights[j];
                if (step < partial) {
                    partial = step;
                    blocking = j;
                }
            }
            // A row in the span of the active ones contradicts them if none can leave, or is violated by rounding
            // alone.
            if (dependent) {
                if (blocking < 0 && violation > kNearlyFeasible * (1 + depth_)) return Outcome::Contradiction;
                const bool rounding =
                    violation < kFeasibleLate * (1 + depth_) && partial > kAbsurdStep * (1 + simd::largest(forces_));
                if (blocking < 0 || rounding) {
                    entering_ = {worst.row, force * p.inverse};
                    return Outcome::Optimal;
                }
            }
            // Reach the plane, or drop the row that blocks.
            if (full <= partial) {
                rows_[basis_.size()] = worst.row;
                basis_.append(p.n, p.d, split);
                place();
                entered = true;
            } else {
                if (!dependent) z_ = simd::fma(partial, split.across, z_);
                forces_ = simd::fnma(partial, split.weights, forces_);
                force += partial;
                drop(blocking);
            }
        }
    }
}

Outcome DualActiveSet::run(double slackPerRow, int limit) {
    slackPerRow_ = slackPerRow;
    entering_ = {-1, 0};
    start();
    const Outcome outcome = pivot(limit);
    if (outcome != Outcome::Optimal) return outcome;
    if (slackPerRow_ == 0 && simd::largest(forces_) > kLargestForce * (1 + depth_)) return Outcome::Unsettled;
    if (entering_.row >= 0 && isAmplified()) settled_ = refine();
    return settled_ ? outcome : Outcome::Unsettled;
}

/// Iterative refinement: corrects z and the forces to the last bit if isAmplified(), that is if planes nearly coincide
/// or forces are far larger than the force that moves the tool. Residuals are computed in extended precision from the
/// rows as given. Returns false if the residuals do not become small.
bool DualActiveSet::refine() {
    for (int round = 0;; ++round) {
        long double step[6], imbalance[6];  // x - h; G (x-h) - J'y
        for (int k = 0; k < 6; ++k) {
            step[k] = (long double)inverseRoot_[k] * z_[k];
            imbalance[k] = problem_->stiffness[k] * step[k];
        }
        // Residuals of the active rows' equations, and their part of the imbalance.
        long double forces = 0;
        double pull = 0;
        simd::Double8 residuals{}, rest{};
        for (int j = 0; j < basis_.size(); ++j) {
            const int row = rows_[j];
            const long double inverse = inverseLengths_[row], y = forces_[j] * inverse;
            long double s = problem_->rows->gap()[row];
            for (int k = 0; k < 6; ++k) {
                const long double entry = problem_->rows->column(k)[row];
                s += entry * (wanted_[k] + step[k]);
                imbalance[k] -= entry * y;
            }
            residuals[j] = double(s * inverse + (long double)slackPerRow_ * z_[6]);
            forces += std::abs(forces_[j]);
            pull = std::max(pull, -forces_[j]);
        }
        if (entering_.row >= 0) {
            for (int k = 0; k < 6; ++k)
                imbalance[k] -= (long double)entering_.value * problem_->rows->column(k)[entering_.row];
            if (inverseLengths_[entering_.row] > 0) forces += entering_.value / inverseLengths_[entering_.row];
        }
        for (int k = 0; k < 6; ++k) rest[k] = double(imbalance[k] * inverseRoot_[k]);
        rest[6] = double(z_[6] - forces * slackPerRow_);
        if (round == kRefinements) {
            const double scale = 1 + depth_ + 1e-6 * (double(forces) + basis_.largestHeight());
            return std::max({simd::largest(simd::abs(residuals)), simd::largest(simd::abs(rest)), pull}) <
                   kSettled * scale;
        }
        // Correct forces and z by the factorized system.
        simd::Double8 du, dz;
        basis_.correct(residuals, rest, du, dz);
        forces_ += du;
        z_ += dz;
    }
}

void DualActiveSet::fill(SolveResult& result) {
    const bool scanned = entering_.row < 0;  // otherwise z moved after the last scan
    for (int k = 0; k < 6; ++k) result.x[k] = wanted_[k] + inverseRoot_[k] * z_[k];
    result.iterations = pivots_;
    result.slack = slackPerRow_ * z_[6];

    int pushing = 0;
    lastActive_.forget();
    for (int j = 0; j < basis_.size(); ++j) {
        const double force = forces_[j] * inverseLengths_[rows_[j]];
        lastActive_.remember(problem_->rows->id(rows_[j]), force);
        if (forces_[j] > 0) answer_[pushing++] = {rows_[j], force};
    }
    if (entering_.row >= 0 && entering_.value > 0) answer_[pushing++] = entering_;
    result.multipliers = {answer_, std::size_t(pushing)};
    result.kkt = scanned ? kktResiduals(*problem_, result.x, result.multipliers, leastGap_)
                         : kktResiduals(*problem_, result.x, result.multipliers);
}

SolveResult DualActiveSet::solve(const QpProblem& problem, const SolverSettings& settings) noexcept {
    SolveResult result;
    m_ = problem.rows ? problem.rows->size() : 0;
    if (!problem.wanted.allFinite() || !problem.stiffness.allFinite() || !(problem.stiffness.minCoeff() > 0) ||
        m_ > capacity_) {
        return result;
    }
    if (m_ == 0) {
        result.status = SolveStatus::Solved;
        result.x = problem.wanted;
        return result;
    }
    problem_ = &problem;
    for (int k = 0; k < 6; ++k) {
        wanted_[k] = problem.wanted[k];
        inverseRoot_[k] = 1 / std::sqrt(problem.stiffness[k]);
    }
    measured_ = false;
    pivots_ = 0;

    const int limit =
        int(std::min<std::int64_t>({kPivotCap, settings.maxIterations, settings.workLimit / std::max(1, m_)}));
    Outcome outcome = run(0, limit);
    if (outcome == Outcome::Invalid) return result;
    if (outcome == Outcome::Contradiction || outcome == Outcome::Unsettled ||
        (outcome == Outcome::PivotCap && limit == kPivotCap)) {
        outcome = run(1 / std::sqrt(settings.elasticWeight), pivots_ + limit);
    }
    result.status = outcome != Outcome::Optimal          ? SolveStatus::IterationLimit
                    : slackPerRow_ > 0 || unsatisfiable_ ? SolveStatus::Elastic
                                                         : SolveStatus::Solved;
    fill(result);
    return result;
}

}  // namespace

std::unique_ptr<Solver> makeDualActiveSet(int capacity) { return std::make_unique<DualActiveSet>(capacity); }

}  // namespace touchstone
