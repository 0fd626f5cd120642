// Friction in default mode.
#include <algorithm>

#include "haptics/loop/default_tick.hpp"
#include "haptics/loop/setting_table.hpp"

namespace touchstone {
namespace {

/// Features that carried force still touch if their distance is at most this multiple of the one that is kept. A turn
/// takes them apart by a few nanometers. With a smaller multiple every tick has to find such contacts again, and a tool
/// that rests takes as long as one that moves; a larger one keeps what has left: at 1.02 a nut holds under an axial
/// force with 2 % less friction.
constexpr double kTouching = 1.003;

}  // namespace

/// restarted: whether the slip counts from restart_ and not since the tick began.
RowContacts::Place DefaultTick::placeOf(std::uint64_t id, bool restarted) const noexcept {
    const int k = obstacleOf(id);
    const Pose X_OT = state_.inObstacle(k, state_.graphic);
    const Vec3 p_O = state_.lists[k]->nearest(X_OT, toolLeafOf(id), obstacleLeafOf(id)).onTool;
    const Vec3 p_T = X_OT.inverse() * p_O;
    const Friction friction = state_.world->friction(std::size_t(k), settings_);
    const auto movedFrom = [&](const Pose& from) {
        return from == X_OT ? Vec3::Zero() : Vec3(state_.R_WO[k] * (p_O - from * p_T));
    };
    const Pose& start = state_.courses[k].X_OT;
    const bool moves = state_.obstacleTravel > 0 && k == state_.lastMoved;
    return {state_.X_WO[k] * p_O - state_.graphic.p, movedFrom(restarted ? state_.inObstacle(k, restart_) : start),
            friction.atRest, friction.sliding, moves ? movedFrom(start) : Vec3::Zero()};
}

/// Adds the rows of features that carry force and that no step has crossed: friction can hold a tool that nothing
/// pushes. Leaves have a row wherever they are near.
void DefaultTick::addLoadedRows() {
    RowSet& added = state_.crossedRows;
    added.clear();
    for (const ContactForces::Contact& contact : state_.forces.loaded()) {
        const int k = obstacleOf(contact.id);
        const ContactList& list = *state_.lists[k];
        if (!list.ofFeatures() || list.suspended() || state_.rows.find(contact.id) >= 0) continue;
        if (state_.rows.size() + added.size() == state_.rows.capacity()) break;
        const Pose before = state_.before(k, state_.graphic), now = state_.inObstacle(k, state_.graphic);
        const ContactList::Nearest at = list.nearest(before, toolLeafOf(contact.id), obstacleLeafOf(contact.id));
        // Features that have left each other may stand beside each other, where the line between them is no normal.
        if (at.gap < list.distance() / 4 || at.gap > list.distance() * kTouching) continue;
        const Vec3 p = now * (before.inverse() * at.onTool);
        const Vec3 n = state_.R_WO[k] * at.normal, r = state_.X_WO[k] * p - state_.graphic.p;
        Vec6 row;
        row << n, r.cross(n);
        // A tool that is nearer than the distance that is kept stays there: the crossings see to it.
        const double gap = std::max(0.0, at.gap - list.distance()) + at.normal.dot(p - at.onTool);
        added.push(row, gap, contact.id);
    }
    state_.rows.merge(added);
}

/// Finds the forces on the state's rows with a drag on the tool, see Tick::problemOf().
ContactForces::Result DefaultTick::solveForces(const Vec6& wanted, double drag) {
    const std::uint64_t start = tick_.now();
    const bool exact = findFrictionSolver(settings_.frictionSolver)->exact;
    FrictionSolver& solver = *named(state_.frictionRenderers, settings_.frictionSolver);
    solver.limitWork(settings_.solverWork);
    const ContactForces::Result result = state_.forces.solve(tick_.problemOf(wanted, drag), solverSettings(settings_),
                                                             *this, *state_.projector, solver, exact);
    TickRecord& record = tick_.record;
    record.iterations += result.iterations;
    if (exact) evaluationsOfTick_ += result.iterations;
    record.status = std::max(record.status, result.status);
    record.frictionStage = std::max(record.frictionStage, int(result.stage));
    tick_.addTime(record.solveUs, start);
    if (result.status == SolveStatus::Invalid) return result;
    if (result.status == SolveStatus::Elastic) record.flags |= kInfeasible;
    if (result.friction == FrictionStatus::Regularized) record.flags |= kFrictionSoft;
    if (result.replaced) {
        record.status = std::max(record.status, SolveStatus::IterationLimit);
        record.flags |= kIterationLimit;
    }
    if (result.restarted) {
        restarted_ = true;
        restart_ = state_.graphic;
    }
    record.coulomb = worstOf(record.coulomb, result.residuals);
    state_.contacts.clear();
    for (const ContactForces::Contact& contact : state_.forces.loaded())
        state_.contacts.push_back({contact.id, contact.normal.dot(contact.force)});
    return result;
}

bool DefaultTick::solveWithFriction(const Vec6& wanted, Step& step) {
    const ContactForces::Result result = solveForces(wanted);
    solvedRows_ = state_.rows.size();
    if (result.status == SolveStatus::Invalid) return false;
    held_ = result.status == SolveStatus::Solved && result.friction == FrictionStatus::None;
    step.rubs = result.status == SolveStatus::Solved && result.friction != FrictionStatus::None;
    step.exact = findFrictionSolver(settings_.frictionSolver)->exact || result.replaced;
    step.rendered = result.x;
    if (!step.rubs || result.friction != FrictionStatus::Approximate || result.overlap <= kViolation)
        return take(result.x, result.status, result.slack, wanted, step);
    const SolveResult onto = tick_.project(result.x);
    return take(onto.x, onto.status, onto.slack, wanted, step);
}

/// Pre: the courses are those of the tick's start. The slip is that of the tick and not of its solves, whose steps may
/// be capped.
void DefaultTick::recordFriction() {
    TickRecord& record = tick_.record;
    record.coulomb.dissipation_mJ = 0;
    Vec3 friction = Vec3::Zero();
    for (const ContactForces::Contact& contact : state_.forces.loaded()) {
        if (!state_.world->friction(std::size_t(obstacleOf(contact.id)), settings_).any()) continue;
        (contact.slides ? record.sliding : record.sticking) += 1;
        const Vec3& n = contact.normal;
        const auto slipped = [&](bool restarted) {
            const Vec3 moved = placeOf(contact.id, restarted).slipped;
            return Vec3(moved - n * n.dot(moved));
        };
        const Vec3 sinceStart = slipped(false);
        record.slip = std::max(record.slip, sinceStart.norm());
        record.coulomb.dissipation_mJ -= contact.force.dot(restarted_ ? slipped(true) : sinceStart);
        friction += contact.force - n * n.dot(contact.force);
    }
    record.frictionForce = friction.norm();
}

}  // namespace touchstone
