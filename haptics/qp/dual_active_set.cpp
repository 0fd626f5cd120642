#include "haptics/qp/dual_active_set.hpp"

#include <algorithm>
#include <cmath>

#include "haptics/math/aligned.hpp"
#include "haptics/qp/basis.hpp"

namespace touchstone {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kPivotCap = 400;             // 58 is the most seen in 100,000 random contacts
constexpr double kFeasible = 1e-14;        // accepted violation, times 1 + depth of h
constexpr double kFeasibleAtLast = 1e-12;  // the same after kPatience pivots: planes may differ by less than rounding
constexpr int kPatience = 100;
constexpr double kNearlyFeasible = 1e-10;  // the same before rows are said to contradict each other
constexpr double kDependent = 1e-26;       // |across|² below this is rounding: the row lies in the active rows' span
constexpr double kLastBits = 4e-16;
constexpr double kWarmIndependent = 1e-12;  // a start takes no row nearer to dependence; a pivot may
constexpr double kSmallestWeight = 1e-12;   // relative; below it a weight is rounding and its row does not block
constexpr double kLargestForce = 1e10;      // times 1 + depth: rows that need more of it contradict each other
constexpr int kRefinements = 2;
constexpr double kSettled = 1e-10;    // residual after them, times 1 + depth and a millionth of the forces
constexpr double kAmplified = 1e4;    // last bits: what is worth a refinement
constexpr double kDoubtful = 1e-3;    // a violation that z's error can feign, times 1 + depth: forces bound the error
constexpr double kAbsurd = 100;       // times the forces: a step that long is rounding
constexpr double kShortest2 = 1e-30;  // squared length of a row without direction

enum class Outcome { Optimal, Contradiction, PivotCap, Unsettled, Invalid };

class DualActiveSet final : public Solver {
  public:
    explicit DualActiveSet(int capacity) : capacity_(capacity), inverseLengths_(paddedToEight(capacity)) {}

    SolveResult solve(const QpProblem& problem, const SolverSettings& settings) noexcept override;
    void reset() noexcept override { remembered_ = 0; }

  private:
    struct Plane {
        simd::Double8 n;  // unit in the metric of G; lane 6 is what the elastic slack adds
        double d;         // n·z + d >= 0
        double inverse;   // 1 / length of the row; 0 without direction
    };
    /// What one look at all rows tells.
    struct Scan {
        double least = kInfinity;  // least n·z + d
        int row = -1;              // where
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

    // The problem at hand.
    const QpProblem* problem_ = nullptr;
    int m_ = 0;
    simd::Double8 wanted_{}, inverseRoot_{};  // h and 1/√G: x = h + inverseRoot_ z
    double slackPerRow_ = 0;                  // 1/√w in the elastic problem, else 0
    bool measured_ = false;                   // the next two and inverseLengths_ are those of this problem
    double depth_ = 0;                        // of h under the rows
    bool hopeless_ = false;                   // a row without direction and with g < 0

    // The state: z nearest to the origin on the planes of the active rows, or on the way to the next such point.
    ActiveBasis basis_;
    int rows_[ActiveBasis::kMax] = {};
    simd::Double8 z_{}, forces_{};  // forces_: the active rows' multipliers, on unit rows
    double leastGap_ = 0;           // least J x + g at z_
    int pivots_ = 0;
    bool settled_ = true;  // what the last refinement of z_ found
    Multiplier entering_;  // a row taken as met that stays out of the basis: see pivot()

    int remembered_ = 0;
    std::uint64_t ids_[ActiveBasis::kMax] = {};
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

/// The first scan of a problem also measures the rows' lengths and the depth of h; least is NaN when a row is not
/// finite.
template <bool first>
DualActiveSet::Scan DualActiveSet::scan() {
    const RowSet& rows = *problem_->rows;
    const simd::Double8 x = wanted_ + inverseRoot_ * z_;
    const simd::Double8 metric = inverseRoot_ * inverseRoot_;
    const double slack = slackPerRow_ * z_[6];
    constexpr simd::Double8 lanes = {0, 1, 2, 3, 4, 5, 6, 7};

    simd::Double8 least = simd::splat(kInfinity), gap = least, depth{}, finite{}, where{};
    simd::Long8 hopeless{};
    for (int i = 0; i < m_; i += 8) {
        const simd::Double8 g = simd::load(rows.gap() + i);
        simd::Double8 j[6];
        simd::Double8 s = g;
#pragma GCC unroll 6
        for (int k = 0; k < 6; ++k) {
            j[k] = simd::load(rows.column(k) + i);
            s += x[k] * j[k];
        }
        simd::Double8 inverse;
        if constexpr (first) {
            simd::Double8 length2{}, d = g;
#pragma GCC unroll 6
            for (int k = 0; k < 6; ++k) {
                length2 += metric[k] * (j[k] * j[k]);
                d += wanted_[k] * j[k];
            }
            inverse = length2 > kShortest2 ? 1 / simd::sqrt(length2) : simd::Double8{};
            simd::store(inverseLengths_.data() + i, inverse);
            const simd::Double8 scaled = d * inverse;
            depth = simd::min(scaled, depth);
            hopeless |= (inverse == 0.0) & (g < 0.0);
            finite += (lanes < double(m_ - i) ? d + length2 : simd::Double8{}) * 0.0;  // padding is not the caller's
        } else {
            inverse = simd::load(inverseLengths_.data() + i);
        }
        gap = simd::min(s, gap);
        s = s * inverse + slack;
        const simd::Long8 lower = s < least;
        least = lower ? s : least;
        where = lower ? simd::splat(double(i)) : where;
    }

    if constexpr (first) {
        measured_ = true;
        depth_ = -simd::least(depth);
        hopeless_ = false;
        for (int lane = 0; lane < 8; ++lane) hopeless_ |= hopeless[lane] != 0;
    }
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

/// Takes the planes of the remembered contacts that are still there and that all push.
void DualActiveSet::start() {
    basis_.clear();
    const int dimensions = slackPerRow_ > 0 ? 7 : 6;
    for (int k = 0; k < remembered_ && basis_.size() < dimensions; ++k) {
        const int row = problem_->rows->find(ids_[k]);
        if (row < 0) continue;
        const Plane p = plane(row);
        const ActiveBasis::Split split = basis_.split(p.n);
        if (p.inverse == 0 || !(split.across2 > kWarmIndependent)) continue;
        rows_[basis_.size()] = row;
        basis_.append(p.n, p.d, split);
    }
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

/// Goldfarb and Idnani's method, from any active rows that all push.
Outcome DualActiveSet::pivot(int limit) {
    for (;;) {
        Scan worst = measured_ ? scan<false>() : scan<true>();
        // Planes that nearly coincide leave z as wrong as their condition times the last bit. Rows that are violated
        // by no more than that decide nothing: pivots on them would end in a contradiction that is not there.
        if (worst.least > -kDoubtful * (1 + depth_) && isAmplified()) {
            settled_ = refine();
            worst = scan<false>();
        }
        leastGap_ = worst.gap;
        if (std::isnan(worst.least)) return Outcome::Invalid;
        const double accepted = pivots_ < kPatience ? kFeasible : kFeasibleAtLast;
        if (worst.least >= -accepted * (1 + depth_) || holds(worst.row)) return Outcome::Optimal;
        if (pivots_ >= limit) return Outcome::PivotCap;

        const Plane p = plane(worst.row);
        double force = 0;                        // of the entering row
        for (bool entered = false; !entered;) {  // steps towards its plane, each but the last losing an active row
            ++pivots_;
            const ActiveBasis::Split split = basis_.split(p.n);
            // What is left of a row is known to the last bits of what was taken from it.
            const double blur = kLastBits * simd::sum(simd::abs(split.weights));
            const bool dependent =
                split.across2 < std::max(kDependent, blur * blur) || basis_.size() == ActiveBasis::kMax;
            const double violation = -simd::sum(p.n * z_) - p.d;
            const double full = dependent ? kInfinity : violation / split.across2;

            const double largest = simd::largest(simd::abs(split.weights));
            const double noise = kSmallestWeight * std::max(1.0, largest);
            double partial = kInfinity;  // until an active row would have to pull
            int blocking = -1;
            for (int j = 0; j < basis_.size(); ++j) {
                if (split.weights[j] <= noise) continue;
                const double step = std::max(0.0, forces_[j]) / split.weights[j];
                if (step < partial) {
                    partial = step;
                    blocking = j;
                }
            }
            if (dependent) {
                if (blocking < 0 && violation > kNearlyFeasible * (1 + depth_)) return Outcome::Contradiction;
                const bool rounding =
                    violation < kFeasibleAtLast * (1 + depth_) && partial > kAbsurd * (1 + simd::largest(forces_));
                if (blocking < 0 || rounding) {
                    entering_ = {worst.row, force * p.inverse};
                    return Outcome::Optimal;
                }
            }
            if (full <= partial) {
                rows_[basis_.size()] = worst.row;
                basis_.append(p.n, p.d, split);
                place();
                entered = true;
            } else {
                if (!dependent) z_ += partial * split.across;
                forces_ -= partial * split.weights;
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

/// Brings z and the forces to the last bit where isAmplified(), by planes that nearly coincide or forces far above what
/// moves the tool: residuals in extended precision from the rows as given. False when they stay.
bool DualActiveSet::refine() {
    for (int round = 0;; ++round) {
        long double step[6], imbalance[6];  // x - h; G (x-h) - J'y
        for (int k = 0; k < 6; ++k) {
            step[k] = (long double)inverseRoot_[k] * z_[k];
            imbalance[k] = problem_->stiffness[k] * step[k];
        }
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
        simd::Double8 du, dz;
        basis_.correct(residuals, rest, du, dz);
        forces_ += du;
        z_ += dz;
    }
}

void DualActiveSet::fill(SolveResult& result) {
    const bool scanned = entering_.row < 0;  // else z moved after the last scan
    for (int k = 0; k < 6; ++k) result.x[k] = wanted_[k] + inverseRoot_[k] * z_[k];
    result.iterations = pivots_;
    result.slack = slackPerRow_ * z_[6];

    int pushing = 0;
    remembered_ = basis_.size();
    for (int j = 0; j < basis_.size(); ++j) {
        ids_[j] = problem_->rows->id(rows_[j]);
        if (forces_[j] > 0) answer_[pushing++] = {rows_[j], forces_[j] * inverseLengths_[rows_[j]]};
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
    result.status = outcome != Outcome::Optimal     ? SolveStatus::IterationLimit
                    : slackPerRow_ > 0 || hopeless_ ? SolveStatus::Elastic
                                                    : SolveStatus::Solved;
    fill(result);
    return result;
}

}  // namespace

std::unique_ptr<Solver> makeDualActiveSet(int capacity) { return std::make_unique<DualActiveSet>(capacity); }

}  // namespace touchstone
