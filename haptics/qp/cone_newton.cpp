#include "haptics/qp/cone_newton.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace touchstone {
namespace {

/// ρ times the compliance of the springs at the contact: the first value in the first Newton steps, each in turn in the
/// rounds that follow if these circle, and the last in the rest. A larger one loses digits. With a smaller one the
/// forces need more corrections, and contacts that clamp a small part, which turns on stiffer springs than it moves on,
/// are not found. What circles with one value often does not with another, so the first rounds begin with a small
/// share.
constexpr struct { double penalty, firstRound; } kConePenalties[] = {{1e5, 1e-2}, {1e4, 1}, {1e6, 1}};
/// Newton steps before f⁰ is held. Ticks that differ little from the last one take 2 to 8; steps that have not
/// converged after 20 mostly circle.
constexpr int kSteps = 20;
/// Steps in which a contact that slid and would now slide back is held instead: two slopes between which a step lies
/// would otherwise send it to and fro.
constexpr int kHeldSteps = 16;
/// A force that is nearer than this to the edge of its cone, relative to friction, starts as one that slides. Between
/// two linearizations the normal turns, and with it the edge: with a smaller value contacts that slide start as ones
/// that stick, from where Newton's steps often circle.
constexpr double kAtEdge = 1e-3;
/// Imbalance, and change of a force in the last correction, at which they are accepted, relative to the forces, but to
/// no more than kMostForce, N. The change bounds gaps and slips of what touches and sticks, times ρ: 1e-15 mm for 1 N.
/// Forces of contacts that contradict each other grow without end, and to them nothing would be far from the law.
constexpr double kBalanced = 1e-11, kForcesSettled = 1e-10, kMostForce = 1e4;
/// Imbalance, relative to the change of the forces, that is small beside what this change does to the next answer:
/// early rounds end at it, and steps that pass a load on slowly pass it on at once. With a smaller one each round takes
/// more steps; with 0.1, rounds with redundant contacts stall. No more than the same part of the forces, since what is
/// clamped may change by far more than the springs pull.
constexpr double kNearlyBalanced = 0.02;
/// Evaluations with an imbalance greater than all forces and than where the steps began, after which they are given up:
/// contacts were far on the wrong side of open, stick and slide, and steps from there seldom converge. One alone often
/// does no harm.
constexpr int kWildSteps = 2;
/// Overlap, gap under load and slip of what sticks at which an answer is exact, mm. Rows contradict each other by about
/// as much, since they are rounded; the forces of such contacts never settle. Up to the second an answer is
/// regularized. Rounds go on to the third while each halves the error, so that rounding does not decide where they end.
constexpr double kExact = 1e-9, kRegularized = 3e-4, kConverged = 1e-13;
/// Rounds with f⁰ held, Newton steps of each, and the factor by which ρ grows up to kMostGrowth times its first value.
/// Nearly parallel contacts settle slowly with a small ρ; with a large one the steps circle. Then ρ falls back by the
/// square of the factor, which becomes smaller; after kFalls that it is given up.
/// There may be no answer if the error has not halved in kStalledRounds and is above kContradicts, mm, or if in
/// kGrowingRounds one after the other forces grew and the overlap stayed the same to kSameOverlap of it.
constexpr int kRounds = 60, kRoundSteps = 10, kFalls = 12, kStalledRounds = 30, kGrowingRounds = 4;
constexpr double kContradicts = 1e-7, kSameOverlap = 0.01;
/// Imbalance of a round, N, which rounding causes if ρ is large.
constexpr double kMostImbalance = 1e-7;
/// Share of the springs below which a pivot is sought, since the derivative may be singular.
constexpr double kPositive = 0.1;
constexpr double kGrowth = 6, kLeastGrowth = 2, kMostGrowth = 1e4;
/// Gap below which a contact that does not take part is crossed, mm.
constexpr double kCrossed = -1e-10;
/// Maximum number of contacts of which each one is left out in turn.
constexpr std::size_t kFew = 6;
/// Lower bound on the share of the slip in w_t, which is 0 where a contact begins to slide and the direction of its
/// force has no derivative.
constexpr double kLeastSlip = 0.05;
/// Imbalance at a point of a path, relative to the forces, and the same by the law after a step with frozen pieces.
constexpr double kOnPath = 1e-9, kPastEvent = 1e-3;
/// Turn of a friction force in one step along a path, rad.
constexpr double kTurn = 0.3;
constexpr double kSmallestStep = 1e-8;
constexpr int kPathSteps = 500, kCorrections = 6;

double sizeOf(const Vec6& wrench, double lever) {
    return std::sqrt(wrench.head<3>().squaredNorm() + wrench.tail<3>().squaredNorm() / (lever * lever));
}

}  // namespace

void ConeNewton::begin(const FrictionProblem& problem, double penalty) {
    problem_ = &problem;
    const double k = problem.stiffness.head<3>().mean(), kr = problem.stiffness.tail<3>().mean();
    lever_ = std::sqrt(kr / k);
    stiffness_ = k;
    force_ = 1 + sizeOf(problem.stiffness.cwiseProduct(problem.wanted), lever_);
    for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
        const FrictionContact& c = problem.contacts[i];
        State& state = states_[i];
        state.piece = Piece::Open;
        state.f0 = state.f = c.startForce;
        state.drift = state.along = Vec3::Zero();
        state.first = state.weight = penalty / (1 / k + c.r.cross(c.n).squaredNorm() / kr);
        state.takesPart = !c.startForce.isZero(0);
        state.leftOut = false;
        force_ += c.startForce.norm();
    }
    force_ = std::min(force_, kMostForce);
}

/// The solutions of derivative_ y = first and second, by elimination on whole rows. Overwrites the derivative.
ConeNewton::Steps ConeNewton::solveFor(const Vec6& first, const Vec6& second) {
    std::array<simd::Double8, 6> rows = derivative_;
#pragma GCC unroll 6
    for (int i = 0; i < 6; ++i) rows[i][6] = first[i], rows[i][7] = second[i];
    Steps steps{{}, {}, false};
    // Without pivots, as for a symmetric positive matrix: friction seldom makes it another.
    bool positive = true;
#pragma GCC unroll 6
    for (int k = 0; k < 6; ++k) {
        const double diagonal = rows[k][k];
        positive = positive && diagonal > kPositive * problem_->stiffness[k];
        rows[k] *= simd::splat(1 / diagonal);
#pragma GCC unroll 6
        for (int i = 0; i < 6; ++i)
            if (i != k) rows[i] = simd::fnma(rows[i][k], rows[k], rows[i]);
    }
    if (!positive) {
        rows = derivative_;
        for (int i = 0; i < 6; ++i) rows[i][6] = first[i], rows[i][7] = second[i];
        for (int k = 0; k < 6; ++k) {
            int pivot = k;
            for (int i = k + 1; i < 6; ++i)
                if (std::abs(rows[i][k]) > std::abs(rows[pivot][k])) pivot = i;
            if (pivot != k) std::swap(rows[k], rows[pivot]);
            steps.reversed = steps.reversed != ((pivot != k) != (rows[k][k] < 0));
            rows[k] *= simd::splat(1 / rows[k][k]);
            for (int i = 0; i < 6; ++i)
                if (i != k) rows[i] = simd::fnma(rows[i][k], rows[k], rows[i]);
        }
    }
#pragma GCC unroll 6
    for (int i = 0; i < 6; ++i) steps.first[i] = rows[i][6], steps.second[i] = rows[i][7];
    return steps;
}

/// Returns the imbalance G (x - h) - Σ (f, r x f). away: 1 - α.
Vec6 ConeNewton::evaluate(const Vec6& x, const Vec6& wanted, double away, Pieces pieces) {
    using simd::Double8;
    ++evaluations_;
    Vec6 imbalance = problem_->stiffness.cwiseProduct(x - wanted);
    if (away != 0) push_.setZero();
    change_ = 0;
    changed_ = false;
    for (auto& row : derivative_) row = Double8{};
    // K is q 1 and terms of rank one. Of q 1, the sums of q, q r and q rr' are the derivative.
    double q = 0;
    Vec3 qr = Vec3::Zero();
    Mat3 qrr = Mat3::Zero();
    for (std::size_t i = 0; i < problem_->contacts.size(); ++i) {
        const FrictionContact& c = problem_->contacts[i];
        State& state = states_[i];
        if (!state.takesPart) continue;
        const Vec3 v = c.motion(x);
        const double vn = c.n.dot(v);
        Vec3 w = state.f0;
        if (away != 0) w -= away * state.drift;
        const double wn = c.n.dot(w);
        state.normal = wn - state.weight * (vn + c.gap);
        Piece piece = Piece::Open;
        Vec3 f = Vec3::Zero();
        if (pieces == Pieces::Frozen ? state.piece != Piece::Open
                                     : state.normal > 0 || (pieces == Pieces::Start && wn > 0)) {
            const Vec3 slip = v + c.slipped;
            w -= wn * c.n + state.weight * (slip - c.n * c.n.dot(slip));
            const double limit = c.coefficient * state.normal, size = w.norm();
            const Vec3 along = size > 0 ? Vec3(w * (1 / size)) : Vec3(Vec3::Zero());
            state.tangential = size;
            state.beyond = size - limit;
            piece = pieces == Pieces::Frozen ? state.piece : state.beyond <= 0 ? Piece::Stick : Piece::Slide;
            if (pieces == Pieces::Start) piece = state.slid ? Piece::Slide : Piece::Stick;
            if (pieces == Pieces::Held && piece == Piece::Slide && state.piece == Piece::Slide &&
                along.dot(state.along) < 0)
                piece = Piece::Stick;
            double round = state.weight;
            if (piece == Piece::Stick) {
                f = state.normal * c.n + w;
            } else {
                f = state.normal * c.n + limit * along;
                double share = limit / size;
                if (pieces == Pieces::Newton || pieces == Pieces::Held) {
                    // Newton's step for f⁰ as well: its direction becomes that of the slip at once.
                    const double gain = 1 / std::max(1 - share, kLeastSlip);
                    const Vec3 across = state.f0 - wn * c.n - along * along.dot(state.f0);
                    f -= (gain - 1) * across;
                    share *= gain;
                }
                state.share = share;
                round *= share;
                const Vec3 rn = c.r.cross(c.n), ra = c.r.cross(along);
                const Double8 n{c.n.x(), c.n.y(), c.n.z(), rn.x(), rn.y(), rn.z()};
                const Double8 a{along.x(), along.y(), along.z(), ra.x(), ra.y(), ra.z()};
                const Double8 byN = n * (state.weight - round);
                const Double8 byA = simd::sumOfProducts(state.weight * c.coefficient, n, -round, a);
                for (int k = 0; k < 6; ++k) derivative_[k] = simd::fma(a[k], byA, simd::fma(n[k], byN, derivative_[k]));
            }
            q += round;
            const Vec3 r = round * c.r;
            qr += r;
            qrr += r * c.r.transpose();
            state.along = along;
            imbalance.head<3>() -= f;
            imbalance.tail<3>() -= c.r.cross(f);
            if (away != 0) {
                const Piece before = std::exchange(state.piece, piece);
                const Vec3 push = resistance(c, state, state.drift) / state.weight;
                state.piece = before;
                push_.head<3>() += push;
                push_.tail<3>() += c.r.cross(push);
            }
        }
        change_ = std::max(change_, (f - state.f0).squaredNorm());
        changed_ = changed_ || piece != state.piece;
        state.piece = piece;
        state.f = f;
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

/// Lets the contact take part that x crosses furthest, and those that it crosses as far. Returns whether there is one.
bool ConeNewton::addCrossed(const Vec6& x) {
    const std::size_t m = problem_->contacts.size();
    double least = kCrossed;
    for (std::size_t i = 0; i < m; ++i)
        if (!states_[i].takesPart && !states_[i].leftOut) least = std::min(least, problem_->contacts[i].distance(x));
    if (least == kCrossed) return false;
    for (std::size_t i = 0; i < m; ++i) {
        State& state = states_[i];
        if (state.takesPart || state.leftOut || problem_->contacts[i].distance(x) > least * (1 - 1e-9)) continue;
        state.takesPart = true;
        state.piece = Piece::Open;
    }
    return true;
}

/// How far the contacts that take part are from the law: the greatest overlap, mm, or friction beyond its cone; of gap
/// and force under it, and of slip and lack of friction against it, the smaller, mm, forces over k; and the energy of
/// all of these, mJ.
ConeNewton::Error ConeNewton::errorAt(const Vec6& x) const {
    double distance = 0, energy = 0;
    for (std::size_t i = 0; i < problem_->contacts.size(); ++i) {
        const FrictionContact& c = problem_->contacts[i];
        const State& state = states_[i];
        if (!state.takesPart) continue;
        const double normal = c.n.dot(state.f), s = c.distance(x), limit = c.coefficient * normal;
        const Vec3 u = c.slip(x);
        const double slip = u.norm(), lost = std::max(0.0, limit * slip + state.f.dot(u));
        const double beyond = (state.f - normal * c.n).norm() - limit;
        distance = std::max({distance, -s, std::min(s, normal / stiffness_), beyond / stiffness_});
        if (slip > 0) distance = std::max(distance, std::min(slip, lost / slip / stiffness_));
        energy += std::max(0.0, normal * s) + lost;
    }
    return {distance, energy};
}

/// Contacts that bear the same load, as three on one edge do, pass ρ (s, u) of it on in each step: for ever, if their
/// rows contradict each other by rounding. Passes on as much at once as lets the first of them open or slide. Returns
/// whether one does.
bool ConeNewton::passOn() {
    double share = INFINITY;
    for (std::size_t i = 0; i < problem_->contacts.size(); ++i) {
        const FrictionContact& c = problem_->contacts[i];
        const State& state = states_[i];
        if (!state.takesPart || state.piece == Piece::Open) continue;
        const Vec3 d = state.f - state.f0;
        const double fn = c.n.dot(state.f), dn = c.n.dot(d);
        if (dn < 0) share = std::min(share, fn / -dn);
        if (state.piece != Piece::Stick) continue;
        const Vec3 ft = state.f - fn * c.n, dt = d - dn * c.n;
        const double mu2 = c.coefficient * c.coefficient;
        const double a = dt.squaredNorm() - mu2 * dn * dn, b = ft.dot(dt) - mu2 * fn * dn;
        const double left = std::max(0.0, mu2 * fn * fn - ft.squaredNorm());
        const double forth = b + std::sqrt(std::max(0.0, b * b + a * left));
        if (forth > 0) share = std::min(share, left / forth);
    }
    if (!std::isfinite(share)) return false;
    for (std::size_t i = 0; i < problem_->contacts.size(); ++i)
        if (State& state = states_[i]; state.takesPart && state.piece != Piece::Open)
            state.f0 = state.f + share * (state.f - state.f0);
    return true;
}

/// Newton's method from x and the forces f⁰. Returns whether it converged, with the forces f.
bool ConeNewton::newton(Vec6& x) {
    const double balanced = kBalanced * force_ * (1 + std::sqrt(double(problem_->contacts.size())));
    for (std::size_t i = 0; i < problem_->contacts.size(); ++i) {
        const FrictionContact& c = problem_->contacts[i];
        State& state = states_[i];
        const double fn = c.n.dot(state.f0);
        state.slid = (state.f0 - fn * c.n).norm() > c.coefficient * fn * (1 - kAtEdge) && fn > 0;
    }
    double before = 0, scale = force_;
    for (int i = 0, left = kSteps, wild = 0; left > 0; ++i, --left) {
        const Pieces pieces = i == 0 ? Pieces::Start : i < kHeldSteps ? Pieces::Held : Pieces::Newton;
        const Vec6 imbalance = evaluate(x, problem_->wanted, 0, pieces);
        const double off = sizeOf(imbalance, lever_);
        if (i <= 1) scale = std::max(scale, off);
        if (off > scale && ++wild == kWildSteps) return false;
        const bool slow = change_ > before / 2;
        before = change_;
        if (!changed_ && pieces != Pieces::Start && off <= std::max(balanced, nearlyBalanced())) {
            const bool settled = change_ <= kForcesSettled * force_ || (slow && errorAt(x).worst() <= kExact);
            if (settled && off <= balanced) {
                if (!addCrossed(x)) return true;
                left = kSteps;
                i = wild = 0;
                scale = force_;
                if (evaluations_ > kMostEvaluations) return false;
                continue;
            }
            if (!settled && slow && i > 1) {  // a first step may move all load
                before = 0;
                if (!passOn()) return false;
                continue;
            }
        }
        const Vec6 dx = -solveFor(imbalance, Vec6::Zero()).first;
        if (!dx.allFinite()) return false;
        x += dx;
        for (std::size_t k = 0; k < problem_->contacts.size(); ++k) {
            State& state = states_[k];
            if (!state.takesPart) continue;
            state.f0 = state.f;
            const FrictionContact& c = problem_->contacts[k];
            if (state.piece != Piece::Open) state.f0 -= resistance(c, state, c.motion(dx));
        }
    }
    return false;
}

/// Newton's method for the pose with f⁰ held. Returns whether it converged, with the forces f and their error: to
/// rounding, or, as long as ρ is small and the answer is not exact, nearly. weight: ρ over its first value, by which
/// rounding grows.
bool ConeNewton::findPose(Vec6& x, double weight, Error& error) {
    const double balanced = std::min(kBalanced * std::max(1.0, weight) * force_, kMostImbalance);
    double scale = force_;
    for (int i = 0, wild = 0; i < kRoundSteps; ++i) {
        const Vec6 imbalance = evaluate(x, problem_->wanted, 0, Pieces::ByLaw);
        const double off = sizeOf(imbalance, lever_);
        const bool nearly = weight <= 1 && off <= nearlyBalanced();
        if (off <= balanced || nearly) {
            error = errorAt(x);
            if (off <= balanced || error.worst() > kExact) return true;
        }
        if (i == 0) scale = std::max(scale, off);
        if (off > scale && ++wild == kWildSteps) return false;
        const Vec6 dx = solveFor(imbalance, Vec6::Zero()).first;
        if (!dx.allFinite()) return false;
        x -= dx;
    }
    return false;
}

/// Rounds from x and the forces f⁰, in which all contacts take part. What it finds is in x and in the forces f. weight:
/// ρ over its first value in the first round.
FrictionStatus ConeNewton::climb(Vec6& x, double weight) {
    const std::size_t m = problem_->contacts.size();
    for (std::size_t i = 0; i < m; ++i) {
        states_[i].takesPart = true;
        states_[i].drift = Vec3::Zero();
        states_[i].weight *= weight;
        forces_[i] = states_[i].before = states_[i].f0;
    }
    Vec6 found = x, best = x;
    Error least{INFINITY, INFINITY}, last{0, 0};
    double growth = kGrowth;
    bool contradicts = false;
    for (int round = 0, climbed = 0, stalled = 0, growing = 0, falls = 0;
         round < kRounds && evaluations_ < kMostEvaluations; ++round) {
        double factor;
        if (Error error; findPose(x, weight, error)) {
            found = x;
            ++stalled;
            const bool same = std::abs(error.distance - last.distance) <= kSameOverlap * error.distance;
            growing = same && error.energy > last.energy ? growing + 1 : 0;
            last = error;
            // Forces of contacts that contradict each other grow without end and to no avail.
            if (error.worst() <= least.worst() / 2) {
                least = error;
                best = x;
                stalled = 0;
                for (std::size_t i = 0; i < m; ++i) forces_[i] = states_[i].f;
            }
            if (least.worst() <= (stalled == 0 ? kConverged : kExact)) break;
            contradicts = least.distance > kContradicts && (stalled >= kStalledRounds || growing >= kGrowingRounds);
            if (contradicts) break;
            factor = std::min(growth, kMostGrowth / weight);
            if (++climbed % 5 == 0) growth = std::min(kGrowth, 2 * growth);
            for (std::size_t i = 0; i < m; ++i) states_[i].before = states_[i].f;
        } else {
            if (least.worst() <= kExact || ++falls > kFalls) break;
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
    for (std::size_t i = 0; i < m; ++i) states_[i].f = forces_[i];
    if (least.worst() <= kExact) return FrictionStatus::Exact;
    if (!contradicts) {
        // Newton's steps pass on what the rounds pass on too slowly.
        for (std::size_t i = 0; i < m; ++i) states_[i].f0 = forces_[i], states_[i].weight = states_[i].first;
        if (newton(x)) return FrictionStatus::Exact;
        x = best;
        for (std::size_t i = 0; i < m; ++i) states_[i].f = forces_[i];
    }
    return least.distance <= kRegularized ? FrictionStatus::Regularized : FrictionStatus::None;
}

/// The step along a path to where a contact first changes its piece, or turns its friction too far. (dx, dAlpha): the
/// direction at the last evaluate().
double ConeNewton::stepToEvent(const Vec6& dx, double dAlpha) const {
    double step = 1;
    for (std::size_t i = 0; i < problem_->contacts.size(); ++i) {
        const FrictionContact& c = problem_->contacts[i];
        const State& state = states_[i];
        const Vec3 dw = dAlpha * state.drift - state.weight * c.motion(dx);
        const double dn = c.n.dot(dw);
        if (state.piece == Piece::Open ? dn > 0 : dn < 0) step = std::min(step, std::max(0.0, -state.normal / dn));
        if (state.piece == Piece::Open) continue;
        const Vec3 dt = dw - c.n * dn, wt = state.along * state.tangential;
        // |w_t + s dw_t|² = µ² (w_n + s dw_n)²
        const double mu2 = c.coefficient * c.coefficient;
        const double a = dt.squaredNorm() - mu2 * dn * dn, b = wt.dot(dt) - mu2 * state.normal * dn;
        const double d = b * b - a * (state.tangential * state.tangential - mu2 * state.normal * state.normal);
        const double outward = state.piece == Piece::Stick ? 1 : -1;
        for (const double root : {-std::sqrt(std::max(0.0, d)), std::sqrt(std::max(0.0, d))}) {
            const double s = (root - b) / a;
            if (d >= 0 && s > 0 && outward * root > 0) step = std::min(step, s);
        }
        if (state.piece == Piece::Slide) {
            const double turn = (dt - state.along * state.along.dot(dt)).norm();
            if (turn * step > kTurn * state.tangential) step = kTurn * state.tangential / turn;
        }
    }
    return step;
}

/// Follows the answers of the problems with the increments α h, and with the drifts of the contacts, from x at α = 0 to
/// α = 1. The path consists of smooth pieces. Where it folds, α falls for a while: the sign of the
/// determinant tells the direction.
bool ConeNewton::follow(Vec6& x) {
    const Vec6& way = problem_->wanted;
    const Vec6 pull = problem_->stiffness.cwiseProduct(way);
    const Vec6 metric =
        problem_->stiffness / std::max(problem_->wanted.dot(problem_->stiffness.cwiseProduct(problem_->wanted)), 1e-12);
    const std::size_t m = problem_->contacts.size();
    double alpha = 0, cap = 1;
    for (int steps = 0; steps < kPathSteps && evaluations_ < kMostEvaluations; ++steps) {
        evaluate(x, alpha * way, 1 - alpha, Pieces::ByLaw);
        const auto [none, slope, reversed] = solveFor(Vec6::Zero(), pull + push_);
        const double length = std::sqrt(slope.dot(metric.cwiseProduct(slope)) + 1) * (reversed ? -1 : 1);
        const Vec6 dx = slope / length;
        const double dAlpha = 1 / length;
        if (!dx.allFinite()) return false;

        double step = std::min(cap, stepToEvent(dx, dAlpha)) + kSmallestStep / 10;
        const bool last = alpha + step * dAlpha >= 1;
        if (last) step = (1 - alpha) / dAlpha;
        const Vec6 x0 = x + step * dx;
        const double alpha0 = last ? 1 : alpha + step * dAlpha;
        for (std::size_t i = 0; i < m; ++i) {
            State& state = states_[i];
            state.normalBefore = state.normal, state.beyondBefore = state.beyond, state.pieceBefore = state.piece;
        }
        // Corrects the step across its direction, or at α = 1 for the pose alone.
        Vec6 y = x0;
        double a = alpha0;
        bool onPath = false;
        for (int i = 0; i < kCorrections && !onPath; ++i) {
            const Vec6 imbalance = evaluate(y, a * way, 1 - a, Pieces::Frozen);
            onPath = sizeOf(imbalance, lever_) <= kOnPath * force_;
            if (onPath) break;
            const auto [toPath, forth, turned] = solveFor(imbalance, pull + push_);
            const Vec6 back = -toPath;
            double d = 0;
            if (!last) {
                const double across = dx.dot(metric.cwiseProduct(y - x0)) + dAlpha * (a - alpha0);
                d = -(across + dx.dot(metric.cwiseProduct(back))) / (dx.dot(metric.cwiseProduct(forth)) + dAlpha);
                y += d * forth;
                a += d;
            }
            y += back;
            if (!y.allFinite()) break;
        }
        double share = 0.5;
        if (onPath &&
            sizeOf(evaluate(y, a * way, 1 - a, Pieces::ByLaw), lever_) > (last ? kOnPath : kPastEvent) * force_) {
            // The step went past an event that the curved path meets earlier.
            onPath = false;
            double least = 1;
            for (std::size_t i = 0; i < m; ++i) {
                const State& state = states_[i];
                if (state.piece == state.pieceBefore) continue;
                const bool normal = state.pieceBefore == Piece::Open || state.piece == Piece::Open;
                const double before = normal ? state.normalBefore : state.beyondBefore;
                const double after = normal ? state.normal : state.beyond;
                if (before != after) least = std::min(least, before / (before - after));
            }
            if (least > 0.05 && least < 1) share = least;
        }
        if (onPath) {
            if (a < -kOnPath) return false;
            x = y, alpha = a;
            if (last) return true;
            cap = std::min(4 * cap, 1.0);
        } else {
            cap = share * step;
            if (step < kSmallestStep) return false;
        }
    }
    return false;
}

/// From x = 0 without force along a path to an answer, and rounds from there.
FrictionStatus ConeNewton::followAndClimb(Vec6& x) {
    const std::size_t m = problem_->contacts.size();
    for (std::size_t i = 0; i < m; ++i) {
        const FrictionContact& c = problem_->contacts[i];
        State& state = states_[i];
        state.f0.setZero();
        state.takesPart = true;
        // Different gaps, so that one contact at a time changes its piece.
        const double away =
            (c.motion(problem_->wanted).norm() + 1e-3) * (0.2 + 0.8 * std::fmod(0.618034 * double(i + 1), 1.0));
        state.drift = state.weight * away * c.n;
    }
    x.setZero();
    if (!follow(x)) return FrictionStatus::None;
    for (std::size_t i = 0; i < m; ++i) states_[i].f0 = states_[i].f;
    return climb(x, 1);
}

FrictionResult ConeNewton::solve(const FrictionProblem& problem, const Vec6& start) noexcept {
    assert(problem.contacts.size() <= states_.size());
    const std::size_t m = problem.contacts.size();
    evaluations_ = 0;
    FrictionResult result;
    double leastError = INFINITY, penalty = kConePenalties[0].penalty;
    // The first answer that is exact, or else the nearest to the law that is regularized.
    const auto attempt = [&](auto&& solveFrom) {
        if (result.status == FrictionStatus::Exact || evaluations_ > kMostEvaluations) return;
        begin(problem, penalty);
        Vec6 x = start;
        const FrictionStatus status = solveFrom(x);
        if (status > result.status) return;
        for (std::size_t i = 0; i < m; ++i) forces_[i] = states_[i].takesPart ? states_[i].f : Vec3::Zero();
        if (status != FrictionStatus::Exact) {
            const CoulombResiduals residuals = coulombResiduals(problem, x, {forces_.data(), m});
            const double worst = std::max({residuals.overlap_mm, residuals.complementarity_mJ, residuals.direction_mJ});
            if (status == result.status && worst >= leastError) return;
            leastError = worst;
        }
        result = {status, x, evaluations_, {}};
        std::copy_n(forces_.begin(), m, found_.begin());
    };
    attempt([&](Vec6& x) { return newton(x) ? FrictionStatus::Exact : FrictionStatus::None; });
    for (const auto& next : kConePenalties) {
        penalty = next.penalty;
        attempt([&](Vec6& x) { return climb(x, next.firstRound); });
    }
    // Of contacts that bear the same load, one that opens by rounding has no force.
    for (std::size_t i = 0; m <= kFew && i < m; ++i)
        attempt([&](Vec6& x) {
            states_[i].f0.setZero();
            states_[i].takesPart = false;
            states_[i].leftOut = true;
            const bool found = newton(x);
            const double distance = problem.contacts[i].distance(x);
            if (!found || distance < -kRegularized) return FrictionStatus::None;
            return distance < -kExact ? FrictionStatus::Regularized : FrictionStatus::Exact;
        });
    // With a gap below zero, or if the slip did not begin here, there may be no answer.
    const auto canStay = [](const FrictionContact& c) { return c.gap >= 0 && c.slipped.isZero(0); };
    if (std::all_of(problem.contacts.begin(), problem.contacts.end(), canStay)) {
        // Without forces the contacts join one by one.
        attempt([&](Vec6& x) {
            for (std::size_t i = 0; i < m; ++i) {
                states_[i].f0.setZero();
                states_[i].takesPart = false;
            }
            return newton(x) ? FrictionStatus::Exact : FrictionStatus::None;
        });
        attempt([&](Vec6& x) { return followAndClimb(x); });
    }
    result.iterations = evaluations_;
    result.forces = {found_.data(), m};
    return result;
}

}  // namespace touchstone
