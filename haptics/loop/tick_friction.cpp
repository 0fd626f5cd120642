#include "haptics/loop/tick_friction.hpp"

#include <algorithm>

#include "haptics/loop/setting_table.hpp"
#include "haptics/math/tick_tuning.hpp"

namespace touchstone {

TickFriction::TickFriction(Tick& tick)
    : tick_(tick), state_(tick.state), settings_(tick.settings), any_(hasFriction(*state_.world, settings_)) {
    if (!any_) state_.forces.forget();
}

bool TickFriction::isSpent() const { return evaluations_ > kEvaluationsOfTick; }

/// restarted: whether the slip counts from restart_ and not since the tick began.
RowContacts::Place TickFriction::placeOf(std::uint64_t id, bool restarted) const noexcept {
    const int k = obstacleOf(id);
    const Pose X_OT = state_.inObstacle(k, state_.graphic);
    const Vec3 p_O = state_.lists[k]->nearest(X_OT, toolLeafOf(id), obstacleLeafOf(id)).onTool;
    const Vec3 p_T = X_OT.inverse() * p_O;
    const Friction friction = state_.world->friction(std::size_t(k), settings_);
    const auto movedFrom = [&](const Pose& from) {
        return from == X_OT ? Vec3::Zero() : Vec3(state_.R_WO[k] * (p_O - from * p_T));
    };
    const Pose& start = state_.motions[k].X_OT;
    const bool moves = state_.obstacleTravel > 0 && k == state_.lastMoved;
    return {state_.X_WO[k] * p_O - state_.graphic.p, movedFrom(restarted ? state_.inObstacle(k, restart_) : start),
            friction.atRest, friction.sliding, moves ? movedFrom(start) : Vec3::Zero()};
}

ContactForces::Result TickFriction::solve(const Vec6& wanted, double damping) {
    const std::uint64_t start = tick_.now();
    const bool exact = findFrictionSolver(settings_.frictionSolver)->exact;
    FrictionSolver& solver = *named(state_.frictionRenderers, settings_.frictionSolver);
    solver.limitWork(settings_.solverWork);
    const ContactForces::Result result = state_.forces.solve(
        tick_.problemOf(wanted, damping), solverSettings(settings_), *this, *state_.projector, solver, exact);
    if (damping == 0) failed_ = result.status == SolveStatus::Solved && result.friction == FrictionStatus::None;
    TickRecord& record = tick_.record;
    record.iterations += result.iterations;
    if (exact) evaluations_ += result.iterations;
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

bool TickFriction::hold(const Pose& start, Wrench& wrench) {
    if (state_.obstacleTravel > 0) return false;
    state_.graphic = start;
    state_.forces.restartTick();
    tick_.record.flags |= kFrictionHeld;
    wrench = state_.wrench;
    tick_.loaded = !wrench.isZero();
    return true;
}

/// The slip is that of the tick and not of its solves, whose steps may be capped.
void TickFriction::record() const {
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
