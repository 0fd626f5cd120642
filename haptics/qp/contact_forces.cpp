#include "haptics/qp/contact_forces.hpp"

#include <algorithm>

#include "haptics/math/simd.hpp"
#include "haptics/math/tick_tuning.hpp"

namespace touchstone {
namespace {

/// Largest violation of a row that an answer may have, and gap up to which a row touches before anything is remembered,
/// mm.
constexpr double kTouches = 1e-9;

/// Calls visit(row) for every row with J x + g <= limit.
template <class Visit>
void forEachBelow(const RowSet& rows, const Vec6& x, double limit, Visit&& visit) {
    for (int i = 0; i < rows.size(); i += 8) {
        simd::Double8 s = simd::load(rows.gap() + i);
        for (int k = 0; k < 6; ++k) s = simd::fma(x[k], simd::load(rows.column(k) + i), s);
        if (simd::least(s) > limit) continue;
        for (int lane = 0; lane < 8 && i + lane < rows.size(); ++lane)
            if (s[lane] <= limit) visit(i + lane, s[lane]);
    }
}

/// The gap to which a tool that is nearer than the distance that is kept may stay: 0, or what an obstacle that moves
/// has taken of the gap in this tick.
double leastGap(const RowContacts& rows, std::uint64_t id, const Vec3& normal) {
    return std::min(0.0, normal.dot(rows.placeOf(id).pushed));
}

}  // namespace

/// Adds the contact of a row. Returns false if there are too many.
bool ContactForces::add(const QpProblem& problem, const RowContacts& rows, int row, const Vec3& force) noexcept {
    if (contacts_.size() == kMaxContacts) return false;
    const Vec6 j = problem.rows->row(row);
    FrictionContact c;
    c.id = problem.rows->id(row);
    c.n = j.head<3>();
    const RowContacts::Place place = rows.placeOf(c.id);
    c.r = c.n.cross(j.tail<3>()) + c.n * c.n.dot(place.r);  // r x n is that of the row
    c.gap = problem.rows->gap()[row];
    if (!restarted_) c.slipped = place.slipped;
    c.startForce = force;
    const int obstacle = int(c.id >> 56);
    bool slides = false, known = false;
    for (const Contact& contact : before_) {
        if (known || int(contact.id >> 56) != obstacle) continue;
        known = contact.id == c.id;
        slides = known ? contact.slides : slides || contact.slides;
    }
    c.coefficient = slides ? place.sliding : place.atRest;
    // What sticks stays even nearer than the distance that is kept: friction may be greater than what pushes it out.
    // If the obstacle itself came nearer, the tool has to give way. Gaps below zero by rounding would leave room for
    // doubt whether it can stay.
    if ((known && !slides && place.pushed.isZero(0)) || c.gap > -kTouches) c.gap = std::max(0.0, c.gap);
    contacts_.push_back(c);
    startForces_.push_back(force);
    return true;
}

/// Lets a tool that is nearer than the distance that is kept stay there. Friction may be greater than what pushes it
/// out, and then there is no other answer. Returns whether there is such a contact.
bool ContactForces::stayInside(const RowContacts& rows) noexcept {
    bool any = false;
    for (FrictionContact& c : contacts_) {
        if (!(c.gap < 0)) continue;
        const double least = leastGap(rows, c.id, c.n);
        any = any || c.gap < least;
        c.gap = std::max(least, c.gap);
    }
    return any;
}

/// Counts the slip from where the tool is. Each linearization of a tick bends the earlier motion, so that what jams can
/// neither go on nor back; from where it is it can always stay. Returns whether anything had slipped.
bool ContactForces::restartSlip() noexcept {
    bool any = false;
    for (FrictionContact& c : contacts_) {
        any = any || !c.slipped.isZero(0);
        c.slipped.setZero();
    }
    restarted_ = restarted_ || any;
    return any;
}

void ContactForces::restoreStartForces() noexcept {
    for (std::size_t i = 0; i < contacts_.size(); ++i) contacts_[i].startForce = startForces_[i];
}

bool ContactForces::knows(std::uint64_t id) const noexcept {
    return std::any_of(contacts_.begin(), contacts_.end(), [&](const FrictionContact& c) { return c.id == id; });
}

/// Adds the contacts that would carry force with the friction of this answer. Rows that it crosses by far are seldom
/// those on which the next answer ends, and each round that adds some of these takes dozens of evaluations. Returns
/// false if there are too many.
bool ContactForces::addExpected(const QpProblem& problem, const SolverSettings& settings, const RowContacts& rows,
                                Solver& frictionless, const FrictionResult& answer, Result& result) noexcept {
    Vec6 friction = Vec6::Zero();
    for (std::size_t i = 0; i < answer.forces.size(); ++i) {
        const FrictionContact& c = contacts_[i];
        const Vec3 along = answer.forces[i] - c.n * c.n.dot(answer.forces[i]);
        friction += (Vec6() << along, c.r.cross(along)).finished();
    }
    const Vec6 wanted = problem.wanted + friction.cwiseQuotient(problem.stiffness);
    const SolveResult expected = frictionless.solve({problem.stiffness, wanted, problem.rows}, settings);
    result.iterations += expected.iterations;
    bool fits = true;
    for (const Multiplier& m : expected.multipliers)
        if (m.value > 0 && !knows(problem.rows->id(m.row))) fits = add(problem, rows, m.row, Vec3::Zero()) && fits;
    return fits;
}

/// Solves, and adds the rows that the answer crosses, until it crosses no more. Returns whether there is an answer.
bool ContactForces::solveWith(FrictionSolver& solver, const QpProblem& problem, const SolverSettings& settings,
                              const RowContacts& rows, Solver& frictionless, Vec6 start, FrictionResult& answer,
                              Result& result) noexcept {
    const auto solveOnce = [&] {
        answer = solver.solve({problem.stiffness, problem.wanted, contacts_}, start);
        result.iterations += answer.iterations;
        result.stage = std::max(result.stage, answer.stage);
    };
    bool crosses = true, fits = true, inside = false;
    // A tool that stays inside does not cross the rows inside which it is.
    const auto crossing = [&](int row, double s) {
        if (!inside) return s;
        const double gap = problem.rows->gap()[row];
        const Vec3 n = problem.rows->row(row).head<3>();
        return gap < 0 ? s - std::min(0.0, gap - leastGap(rows, problem.rows->id(row), n)) : s;
    };
    for (int round = 0; crosses && fits && round < kCrossedRounds; ++round) {
        solveOnce();
        const bool approximate = answer.status == FrictionStatus::Approximate;
        const auto fails = [&] { return answer.status != FrictionStatus::Exact && !approximate; };
        if (fails() && stayInside(rows)) {
            inside = true;
            solveOnce();
        }
        if (fails() && restartSlip()) solveOnce();
        if (answer.status == FrictionStatus::None) return false;
        start = answer.x;
        for (std::size_t i = 0; i < contacts_.size(); ++i) contacts_[i].startForce = answer.forces[i];
        double least = 0;
        int crossed = 0;
        result.overlap = 0;
        forEachBelow(*problem.rows, answer.x, -kTouches, [&](int row, double s) {
            result.overlap = std::max(result.overlap, -s);
            s = crossing(row, s);
            if (s > -kTouches || knows(problem.rows->id(row))) return;
            least = std::min(least, s);
            ++crossed;
        });
        crosses = least < 0;
        if (!crosses) break;
        // An approximate answer takes more rounds than there are rows to add one by one.
        const double limit = approximate ? -kTouches : least * (1 - 1e-9);
        forEachBelow(*problem.rows, answer.x, limit, [&](int row, double s) {
            if (crossing(row, s) <= limit && !knows(problem.rows->id(row)))
                fits = add(problem, rows, row, Vec3::Zero()) && fits;
        });
        // An approximate answer has them already.
        if (!approximate && crossed > 1)
            fits = addExpected(problem, settings, rows, frictionless, answer, result) && fits;
        if (inside) stayInside(rows);
    }
    return !crosses && fits;
}

ContactForces::Result ContactForces::solve(const QpProblem& problem, const SolverSettings& settings,
                                           const RowContacts& rows, Solver& frictionless, FrictionSolver& solver,
                                           bool exact) noexcept {
    Result result;
    contacts_.clear();
    startForces_.clear();
    restarted_ = false;
    Vec6 start = Vec6::Zero();
    for (const Contact& contact : last_) {
        const int row = problem.rows->find(contact.id);
        if (row >= 0) add(problem, rows, row, contact.force);
    }
    const auto solveWithout = [&] {
        const SolveResult without = frictionless.solve(problem, settings);
        result.status = without.status;
        result.x = without.x;
        result.iterations += without.iterations;
        result.slack = without.slack;
        return without.multipliers;
    };
    if (contacts_.empty()) {
        const auto multipliers = solveWithout();
        last_.clear();
        if (result.status != SolveStatus::Solved || multipliers.empty()) {
            result.friction = FrictionStatus::Exact;  // of an answer without contact there is nothing to add
            return result;
        }
        double total = 0;
        int touching = 0;
        for (const Multiplier& m : multipliers) total += m.value;
        forEachBelow(*problem.rows, result.x, kTouches, [&](int, double) { ++touching; });
        touching = std::min(touching, kMaxContacts);
        // All that touch begin alike, so that the pressure of flat contacts is even.
        forEachBelow(*problem.rows, result.x, kTouches, [&](int row, double) {
            add(problem, rows, row, total / touching * problem.rows->row(row).head<3>());
        });
        start = result.x;
    }
    FrictionResult answer;
    begun_ = contacts_;
    bool solved = solveWith(solver, problem, settings, rows, frictionless, start, answer, result);
    if (!solved &&
        !exact) {  // the exact solver may answer what the other one could not, so gaps and slips are as given
        contacts_ = begun_;
        startForces_.resize(begun_.size());
        restarted_ = false;
        solved = solveWith(exact_, problem, settings, rows, frictionless, start, answer, result);
        result.replaced = solved;
    }
    restoreStartForces();
    result.friction = solved ? answer.status : FrictionStatus::None;
    // Rows that contradict each other have no answer with friction either. An answer that violates none shows that they
    // do not.
    const bool feasible = solved && result.overlap == 0;
    if (result.friction != FrictionStatus::Exact && !feasible) {
        solveWithout();
        if (result.status != SolveStatus::Solved) {
            last_.clear();
            return result;
        }
    }
    result.status = SolveStatus::Solved;
    if (result.friction == FrictionStatus::None) return result;
    result.restarted = restarted_;
    result.x = answer.x;
    result.residuals = coulombResiduals({problem.stiffness, problem.wanted, contacts_}, result.x, answer.forces);
    last_.clear();
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
        const FrictionContact& c = contacts_[i];
        const Vec3& force = answer.forces[i];
        const double normal = c.n.dot(force);
        if (!(normal > 0)) continue;
        const double slip = c.slip(result.x).norm();
        last_.push_back({c.id, force, c.n, slip > kSlips});
    }
    std::sort(last_.begin(), last_.end(), [](const Contact& a, const Contact& b) { return a.id < b.id; });
    return result;
}

void ContactForces::endTick() noexcept { before_ = last_; }

}  // namespace touchstone
