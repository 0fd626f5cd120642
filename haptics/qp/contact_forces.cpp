#include "haptics/qp/contact_forces.hpp"

#include <algorithm>

#include "haptics/math/simd.hpp"

namespace touchstone {
namespace {

/// Largest violation of a row that an answer may have, and gap up to which a row touches before anything is remembered,
/// mm.
constexpr double kAccepted = 1e-9;
/// Slip of a contact in a tick above which it slides, mm. What sticks gives way by less than 1e-11 mm.
constexpr double kSlips = 1e-9;
/// Maximum number of rounds in which crossed rows are added. Three are usual.
constexpr int kCrossedRounds = 64;

/// Calls visit(row) for every row with J x + g <= limit.
template <class Visit>
void forEachBelow(const RowSet& rows, const Vec6& x, double limit, Visit&& visit) {
    for (int i = 0; i < rows.size(); i += 8) {
        simd::Double8 s = simd::load(rows.gap() + i);
        for (int k = 0; k < 6; ++k) s += x[k] * simd::load(rows.column(k) + i);
        if (simd::least(s) > limit) continue;
        for (int lane = 0; lane < 8 && i + lane < rows.size(); ++lane)
            if (s[lane] <= limit) visit(i + lane, s[lane]);
    }
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
    c.slipped = place.slipped;
    c.startForce = force;
    const int obstacle = int(c.id >> 56);
    bool slides = false, known = false;
    for (const Contact& contact : before_) {
        if (known || int(contact.id >> 56) != obstacle) continue;
        known = contact.id == c.id;
        slides = known ? contact.slides : slides || contact.slides;
    }
    c.coefficient = slides ? place.sliding : place.atRest;
    contacts_.push_back(c);
    return true;
}

ContactForces::Result ContactForces::solve(const QpProblem& problem, const SolverSettings& settings,
                                           const RowContacts& rows, Solver& frictionless) noexcept {
    Result result;
    contacts_.clear();
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
        forEachBelow(*problem.rows, result.x, kAccepted, [&](int, double) { ++touching; });
        touching = std::min(touching, kMaxContacts);
        // All that touch begin alike, so that the pressure of flat contacts is even.
        forEachBelow(*problem.rows, result.x, kAccepted, [&](int row, double) {
            add(problem, rows, row, total / touching * problem.rows->row(row).head<3>());
        });
        start = result.x;
    }
    FrictionResult answer;
    bool crosses = true, fits = true;
    for (int round = 0; crosses && fits && round < kCrossedRounds; ++round) {
        answer = solver_.solve({problem.stiffness, problem.wanted, contacts_}, start);
        result.iterations += answer.iterations;
        if (answer.status == FrictionStatus::None) break;
        start = answer.x;
        for (std::size_t i = 0; i < contacts_.size(); ++i) contacts_[i].startForce = answer.forces[i];
        double least = 0;
        forEachBelow(*problem.rows, answer.x, -kAccepted, [&](int, double s) { least = std::min(least, s); });
        const std::size_t known = contacts_.size();
        if (least < 0) {
            forEachBelow(*problem.rows, answer.x, least * (1 - 1e-9), [&](int row, double) {
                const auto same = [&](const FrictionContact& c) { return c.id == problem.rows->id(row); };
                if (std::none_of(contacts_.begin(), contacts_.end(), same))
                    fits = add(problem, rows, row, Vec3::Zero()) && fits;
            });
        }
        crosses = contacts_.size() > known;
    }
    result.friction = crosses || !fits ? FrictionStatus::None : answer.status;
    if (result.friction != FrictionStatus::Exact) {
        solveWithout();
        if (result.status != SolveStatus::Solved) {
            last_.clear();
            return result;
        }
    }
    result.status = SolveStatus::Solved;
    if (result.friction == FrictionStatus::None) return result;
    result.x = answer.x;
    result.residuals = coulombResiduals({problem.stiffness, problem.wanted, contacts_}, answer.x, answer.forces);
    last_.clear();
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
        const FrictionContact& c = contacts_[i];
        const Vec3& force = answer.forces[i];
        const double normal = c.n.dot(force);
        if (!(normal > 0)) continue;
        const double slip = c.slip(answer.x).norm();
        last_.push_back({c.id, force, c.n, slip, slip > kSlips});
    }
    std::sort(last_.begin(), last_.end(), [](const Contact& a, const Contact& b) { return a.id < b.id; });
    return result;
}

void ContactForces::endTick() noexcept { before_ = last_; }

}  // namespace touchstone
