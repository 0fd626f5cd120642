#include "haptics/qp/cone_newton.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "haptics/math/tick_tuning.hpp"

namespace touchstone {
namespace {

/// A contact that does not take part joins if its gap falls below this, mm.
constexpr double kJoins = -1e-10;

double sizeOf(const Vec6& wrench, double lever) {
    return std::sqrt(wrench.head<3>().squaredNorm() + wrench.tail<3>().squaredNorm() / (lever * lever));
}

}  // namespace

void ConeNewton::begin(const FrictionProblem& problem) {
    problem_ = &problem;
    rounding_ = 0;
    const double k = problem.stiffness.head<3>().mean(), kr = problem.stiffness.tail<3>().mean();
    lever_ = std::sqrt(kr / k);
    force_ = 1 + sizeOf(problem.stiffness.cwiseProduct(problem.wanted), lever_);
    for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
        const FrictionContact& c = problem.contacts[i];
        State& state = states_[i];
        state.law = {};
        state.f0 = state.law.force = c.startForce;
        state.soft = 1 / (1 / k + c.r.cross(c.n).squaredNorm() / kr);
        state.weight = kPenalty * state.soft;
        state.takesPart = !c.startForce.isZero(0);
        force_ += c.startForce.norm();
    }
    force_ = std::min(force_, kMostForce);
}

/// Solves derivative_ y = first and derivative_ y = second, by elimination on whole rows. It needs no
/// pivots: friction seldom makes the matrix differ much from a symmetric positive one.
ConeNewton::Steps ConeNewton::solveFor(const Vec6& first, const Vec6& second) {
    std::array<simd::Double8, 6> rows = derivative_;
#pragma GCC unroll 6
    for (int i = 0; i < 6; ++i) rows[i][6] = first[i], rows[i][7] = second[i];
    Steps steps{{}, {}, false};
#pragma GCC unroll 6
    for (int k = 0; k < 6; ++k) {
        const double diagonal = rows[k][k];
        steps.reversed ^= diagonal < 0;
        rows[k] *= simd::splat(1 / diagonal);
#pragma GCC unroll 6
        for (int i = 0; i < 6; ++i)
            if (i != k) rows[i] = simd::fnma(rows[i][k], rows[k], rows[i]);
    }
#pragma GCC unroll 6
    for (int i = 0; i < 6; ++i) steps.first[i] = rows[i][6], steps.second[i] = rows[i][7];
    return steps;
}

/// Returns the imbalance G (x - h) - Σ (f, r x f).
Vec6 ConeNewton::evaluate(const Vec6& x, Modes modes) {
    using simd::Double8;
    ++evaluations_;
    Vec6 imbalance = problem_->stiffness.cwiseProduct(x - problem_->wanted);
    const bool rounds = modes == Modes::ByLaw && rounding_ > 0;
    if (rounds) push_.setZero();
    change_ = 0;
    changed_ = false;
    for (auto& row : derivative_) row = Double8{};
    // The derivative of a contact's force is q 1 plus terms of rank one. The part q 1 of all contacts needs only the
    // sums of q, q r and q rr'.
    double q = 0;
    Vec3 qr = Vec3::Zero();
    Mat3 qrr = Mat3::Zero();
    for (std::size_t i = 0; i < problem_->contacts.size(); ++i) {
        const FrictionContact& c = problem_->contacts[i];
        State& state = states_[i];
        if (!state.takesPart) continue;
        const Vec3 motion = c.motion(x), u = motion + c.slipped;
        // w = f⁰ - ρ (s, u), and its projection onto the cone.
        const Vec3 w = state.f0 - state.weight * (u + (c.n.dot(motion) + c.gap - c.n.dot(u)) * c.n);
        const ContactMode before = state.law.mode;
        Vec3 widened;
        if (rounds)
            state.law = projectRounded(w, c.n, c.coefficient, rounding_, widened);
        else
            state.law = projectOntoCone(w, c.n, c.coefficient, [&](ContactMode mode, const Vec3& along) {
                if (modes == Modes::Start && (mode != ContactMode::Open || c.n.dot(state.f0) > 0))
                    return state.slid ? ContactMode::Slide : ContactMode::Stick;
                const bool back = modes == Modes::Newton && mode == ContactMode::Slide &&
                                  before == ContactMode::Slide && along.dot(state.law.along) < 0;
                return back ? ContactMode::Stick : mode;
            });
        ConeForce& law = state.law;
        change_ = std::max(change_, (law.force - state.f0).squaredNorm());
        changed_ = changed_ || law.mode != before;
        if (law.mode != ContactMode::Open) {
            if (law.mode == ContactMode::Slide && modes == Modes::Newton) {
                // Correct f⁰ in the same step: its direction becomes that of the slip at once.
                const double gain = 1 / std::max(1 - law.share, kLeastSlip);
                law.force -= (gain - 1) * (state.f0 - c.n * c.n.dot(state.f0) - law.along * law.along.dot(state.f0));
                law.share *= gain, law.fall *= gain;
            }
            if (law.mode == ContactMode::Slide) {
                // The terms of rank one.
                const Vec3 rn = c.r.cross(c.n), ra = c.r.cross(law.along);
                const Double8 n{c.n.x(), c.n.y(), c.n.z(), rn.x(), rn.y(), rn.z()};
                const Double8 a{law.along.x(), law.along.y(), law.along.z(), ra.x(), ra.y(), ra.z()};
                const Double8 byN = n * (state.weight * (law.rise - law.share));
                const Double8 byA = simd::sumOfProducts(state.weight * law.lean, n, -state.weight * law.fall, a);
                for (int k = 0; k < 6; ++k) derivative_[k] = simd::fma(a[k], byA, simd::fma(n[k], byN, derivative_[k]));
            }
            // The part q 1, and the force.
            const double round = state.weight * law.share;
            q += round;
            const Vec3 r = round * c.r;
            qr += r;
            qrr += r * c.r.transpose();
            imbalance.head<3>() -= law.force;
            imbalance.tail<3>() -= c.r.cross(law.force);
            if (rounds) {
                const Vec3 push = law.derivative(c.n, w - state.f0) - rounding_ / 2 * widened;
                push_.head<3>() += push;
                push_.tail<3>() += c.r.cross(push);
            }
        }
    }
    const Vec6& g = problem_->stiffness;
    const double trace = qrr.trace();
    derivative_[0] += Double8{g[0] + q, 0, 0, 0, qr.z(), -qr.y()};
    derivative_[1] += Double8{0, g[1] + q, 0, -qr.z(), 0, qr.x()};
    derivative_[2] += Double8{0, 0, g[2] + q, qr.y(), -qr.x(), 0};
    derivative_[3] += Double8{0, -qr.z(), qr.y(), g[3] + trace - qrr(0, 0), -qrr(0, 1), -qrr(0, 2)};
    derivative_[4] += Double8{qr.z(), 0, -qr.x(), -qrr(1, 0), g[4] + trace - qrr(1, 1), -qrr(1, 2)};
    derivative_[5] += Double8{-qr.y(), qr.x(), 0, -qrr(2, 0), -qrr(2, 1), g[5] + trace - qrr(2, 2)};
    change_ = std::sqrt(change_);
    return imbalance;
}

double ConeNewton::nearlyBalanced() const { return kNearlyBalanced * std::min(change_, force_); }

/// Adds the contact that x crosses furthest, and those that it crosses as far. Returns whether there is one.
bool ConeNewton::addCrossed(const Vec6& x) {
    const std::size_t m = problem_->contacts.size();
    double least = kJoins;
    for (std::size_t i = 0; i < m; ++i)
        if (!states_[i].takesPart) least = std::min(least, problem_->contacts[i].distance(x));
    if (least == kJoins) return false;
    for (std::size_t i = 0; i < m; ++i) {
        State& state = states_[i];
        if (state.takesPart || problem_->contacts[i].distance(x) > least * (1 - 1e-9)) continue;
        state.takesPart = true;
        state.law = {};
    }
    return true;
}

/// The distance from the law, mm, with forces divided by k: the greatest of any contact's overlap, friction beyond the
/// cone, min(gap, normal force), and min(slip, friction that is missing against it). Unlike the energies of
/// CoulombResiduals it sees a slow slip at the edge of the cone.
double ConeNewton::errorAt(const Vec6& x) const {
    double error = 0;
    const double k = problem_->stiffness.head<3>().mean();
    for (std::size_t i = 0; i < problem_->contacts.size(); ++i) {
        const FrictionContact& c = problem_->contacts[i];
        const State& state = states_[i];
        if (!state.takesPart) continue;
        const Vec3 &f = state.law.force, u = c.slip(x);
        const double normal = c.n.dot(f), s = c.distance(x), limit = c.coefficient * normal, slip = u.norm();
        error = std::max({error, -s, std::min(s, normal / k), ((f - normal * c.n).norm() - limit) / k});
        if (slip > 0) error = std::max(error, std::min(slip, (limit + f.dot(u) / slip) / k));
    }
    return error;
}

/// Writes the forces to forces_, and returns how far x and the forces are from the law.
CoulombResiduals ConeNewton::residualsAt(const Vec6& x) {
    const std::size_t m = problem_->contacts.size();
    for (std::size_t i = 0; i < m; ++i) forces_[i] = states_[i].takesPart ? states_[i].law.force : Vec3::Zero();
    return coulombResiduals(*problem_, x, {forces_.data(), m});
}

/// Newton's method from x and the forces f⁰. Returns whether it converged.
bool ConeNewton::newton(Vec6& x) {
    const double balanced = kBalanced * force_ * (1 + std::sqrt(double(problem_->contacts.size())));
    for (std::size_t i = 0; i < problem_->contacts.size(); ++i) {
        const FrictionContact& c = problem_->contacts[i];
        State& state = states_[i];
        const double fn = c.n.dot(state.f0);
        state.slid = (state.f0 - fn * c.n).norm() > c.coefficient * fn * (1 - kAtEdge) && fn > 0;
    }
    double before = 0, scale = force_;
    for (int i = 0, wild = 0; i < kNewtonSteps; ++i) {
        const Vec6 imbalance = evaluate(x, i == 0 ? Modes::Start : Modes::Newton);
        const double off = sizeOf(imbalance, lever_);
        if (i <= 1) scale = std::max(scale, off);
        if (off > scale && ++wild == kWildSteps) return false;
        const bool slow = change_ > before / 2;
        before = change_;
        if (i > 0 && !changed_ && off <= balanced &&
            (change_ <= kForcesSettled * force_ || (slow && errorAt(x) <= kErrorSettled))) {
            if (!addCrossed(x)) return true;
            i = wild = 0;
            scale = force_;
            if (evaluations_ > kEvaluationsOfSolve) return false;
            continue;
        }
        // Contacts that share a load pass it on slowly in these steps, and at once in rounds.
        if (i > 1 && !changed_ && slow && off <= std::max(balanced, nearlyBalanced())) return false;
        const Vec6 dx = -solveFor(imbalance, Vec6::Zero()).first;
        if (!dx.allFinite()) return false;
        x += dx;
        for (std::size_t k = 0; k < problem_->contacts.size(); ++k) {
            State& state = states_[k];
            if (!state.takesPart) continue;
            const FrictionContact& c = problem_->contacts[k];
            state.f0 = state.law.force;
            if (state.law.mode != ContactMode::Open) state.f0 -= state.weight * state.law.derivative(c.n, c.motion(dx));
        }
    }
    return false;
}

/// Newton's method for the pose with f⁰ held. Returns whether it converged. While ρ is small and the answer is not
/// exact, nearlyBalanced() suffices. weight: ρ over its first value; rounding errors grow with it.
bool ConeNewton::findPose(Vec6& x, double weight, double& error) {
    const double balanced = std::min(kBalanced * std::max(1.0, weight) * force_, kMostImbalance);
    double scale = force_;
    for (int i = 0, wild = 0; i < kRoundSteps; ++i) {
        const Vec6 imbalance = evaluate(x, Modes::ByLaw);
        const double off = sizeOf(imbalance, lever_);
        const bool nearly = weight <= 1 && off <= nearlyBalanced();
        if (off <= balanced || nearly) {
            error = errorAt(x);
            if (off <= balanced || error > kErrorSettled) return true;
        }
        if (i == 0) scale = std::max(scale, off);
        if (off > scale && ++wild == kWildSteps) return false;
        const Vec6 dx = solveFor(imbalance, Vec6::Zero()).first;
        if (!dx.allFinite()) return false;
        x -= dx;
    }
    return false;
}

/// Rounds from x and the forces f⁰, with all contacts: finds the pose for f⁰, takes its forces as f⁰, and raises ρ.
/// Keeps the best round. Returns whether its error is small enough.
bool ConeNewton::climb(Vec6& x) {
    const std::size_t m = problem_->contacts.size();
    double weight = kFirstRound, growth = kGrowth, least = INFINITY;
    for (std::size_t i = 0; i < m; ++i) {
        states_[i].takesPart = true;
        states_[i].weight *= weight;
        states_[i].before = best_[i] = states_[i].f0;
    }
    Vec6 found = x, best = x;
    for (int round = 0, climbed = 0, stalled = 0, falls = 0; round < kRounds && evaluations_ < kEvaluationsOfSolve;
         ++round) {
        double factor;
        if (double error; findPose(x, weight, error)) {
            // The round converged: keep it if it halved the error, and raise ρ.
            found = x;
            ++stalled;
            if (error <= least / 2) {
                least = error;
                best = x;
                stalled = 0;
                for (std::size_t i = 0; i < m; ++i) best_[i] = states_[i].law.force;
            }
            if (least <= (stalled == 0 ? kConverged : kErrorSettled) || stalled == kRounds / 2) break;
            factor = std::min(growth, kMostGrowth / weight);
            if (++climbed % 5 == 0) growth = std::min(kGrowth, 2 * growth);
            for (std::size_t i = 0; i < m; ++i) states_[i].before = states_[i].law.force;
        } else {
            // The steps circled: go back to the last round, with a smaller ρ and a smaller factor.
            if (least <= kErrorSettled || ++falls > kFalls) break;
            x = found;
            factor = 1 / (growth * growth);
            growth = std::max(kLeastGrowth, std::sqrt(growth));
            climbed = 0;
        }
        weight *= factor;
        for (std::size_t i = 0; i < m; ++i) {
            states_[i].weight *= factor;
            states_[i].f0 = states_[i].before;
        }
    }
    x = best;
    for (std::size_t i = 0; i < m; ++i) states_[i].law.force = best_[i];
    return least <= kErrorSettled;
}

/// Sets ρ to exp(logarithm) times the springs, and the rounding of corners that belongs to it.
void ConeNewton::stiffen(double logarithm) {
    for (std::size_t i = 0; i < problem_->contacts.size(); ++i)
        states_[i].weight = std::exp(logarithm) * states_[i].soft;
    rounding_ = force_ / std::sqrt(kDecades) * std::exp(-logarithm / 2);
}

/// Continuation: follows the answers for the forces f⁰ by arc length in x and log ρ, from a small ρ. Where the path
/// folds, ρ falls for a while; the sign of the determinant gives the direction. Returns whether rounds from one of its
/// points found an answer. If not, x is the last point.
bool ConeNewton::follow(Vec6& x) {
    const std::size_t m = problem_->contacts.size();
    const Vec6 metric = problem_->stiffness / std::max(force_ * force_ / problem_->stiffness.head<3>().mean(), 1e-12);
    for (std::size_t i = 0; i < m; ++i) {
        states_[i].takesPart = true;
        states_[i].before = states_[i].f0;
    }
    const double decades = std::log(kDecades), end = 5 * decades, enough = kOnPath * force_;
    double at = -decades, trial = 2 * decades, cap = 1;
    Vec6 slope = Vec6::Zero();
    x = problem_->wanted;
    for (bool begun = false; evaluations_ < kEvaluationsOfSolve;) {
        // Predict the next point along the tangent. The first point is sought at the given ρ.
        double to = at;
        Vec6 y = x, start = x;
        if (begun) {
            stiffen(at);
            evaluate(x, Modes::ByLaw);
            const auto [none, along, reversed] = solveFor(Vec6::Zero(), push_);
            slope = along;
            if (!slope.allFinite()) return false;
            const double step = cap / std::sqrt(slope.dot(metric.cwiseProduct(slope)) + 1) * (reversed ? -1 : 1);
            to = std::min(at + step, end);
            start = y = x + (1 - std::exp(at - to)) * slope;  // linear in 1/ρ
        }
        const double planned = to;
        const bool fixed = !begun || planned == end;
        // Correct it by Newton's steps, across the tangent unless its ρ is fixed.
        bool onPath = false;
        int corrections = 0;
        for (; corrections < kCorrections * (begun ? 1 : 5) && !onPath; ++corrections) {
            stiffen(to);
            const Vec6 imbalance = evaluate(y, Modes::ByLaw);
            onPath = sizeOf(imbalance, lever_) <= enough;
            if (onPath) break;
            const auto [back, forth, reversed] = solveFor(imbalance, push_);
            double d = 0;
            if (!fixed) {
                const double across = slope.dot(metric.cwiseProduct(y - back - start)) + to - planned;
                d = -across / (slope.dot(metric.cwiseProduct(forth)) + 1);
            }
            y += d * forth - back;
            to += d;
            if (!y.allFinite() || !(std::abs(to - at) < 20)) break;
        }
        // If that failed, shorten the step; if not, accept the point and lengthen the next step.
        if (!onPath) {
            cap /= 2;
            if (!begun || cap < kOnPath) return false;
            continue;
        }
        begun = true;
        x = y;
        at = to;
        if (corrections <= kCorrections / 2) cap = std::min(2 * cap, decades);
        if (at < -2 * decades) return false;
        if (at < trial && at < end) continue;
        trial = at + decades;
        // Try to finish by rounds from here, with this ρ and sharp corners.
        rounding_ = 0;
        for (std::size_t i = 0; i < m; ++i) best_[i] = states_[i].f0 = states_[i].law.force;
        double error, before = INFINITY;
        for (int round = 0; round < kRoundSteps && findPose(y, std::exp(at), error); ++round) {
            if (error <= kConverged || (error <= kErrorSettled && error > before / 2)) {
                x = y;
                return true;
            }
            before = error;
            for (std::size_t i = 0; i < m; ++i) states_[i].f0 = states_[i].law.force;
        }
        for (std::size_t i = 0; i < m; ++i) {
            states_[i].f0 = states_[i].before;
            states_[i].law.force = best_[i];
        }
        if (at >= end) return false;
    }
    return false;
}

FrictionResult ConeNewton::solve(const FrictionProblem& problem, const Vec6& start) noexcept {
    assert(problem.contacts.size() <= states_.size());
    const std::size_t m = problem.contacts.size();
    evaluations_ = 0;
    FrictionResult result;
    double least = INFINITY;
    // Keep the first exact answer, or else the one nearest to the law.
    const auto attempt = [&](FrictionStage stage, auto&& solveFrom) {
        if (result.status == FrictionStatus::Exact || evaluations_ > kEvaluationsOfSolve) return;
        begin(problem);
        Vec6 x = start;
        const bool found = solveFrom(x);
        if (!found && stage == FrictionStage::Newton) return;
        const CoulombResiduals residuals = residualsAt(x);
        const bool inside =
            std::max(residuals.balance_N, residuals.cone_N) <= kRegularized && residuals.overlap_mm <= kRegularized;
        const FrictionStatus status = residuals.isExact() ? FrictionStatus::Exact
                                      : inside            ? FrictionStatus::Regularized
                                                          : FrictionStatus::None;
        if (status > result.status || (status == result.status && residuals.worst() >= least)) return;
        least = residuals.worst();
        result.status = status;
        result.stage = stage;
        result.x = x;
        found_.swap(forces_);
    };
    attempt(FrictionStage::Newton, [&](Vec6& x) { return newton(x); });
    attempt(FrictionStage::Rounds, [&](Vec6& x) { return climb(x); });
    for (const bool unloaded : {false, true})
        attempt(FrictionStage::Continuation, [&](Vec6& x) {
            for (std::size_t i = 0; unloaded && i < m; ++i) states_[i].f0.setZero();
            return follow(x);
        });
    result.iterations = evaluations_;
    result.forces = {found_.data(), m};
    return result;
}

}  // namespace touchstone
