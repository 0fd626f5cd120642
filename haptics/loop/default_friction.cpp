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

bool DefaultTick::solveWithFriction(const Vec6& wanted, Step& step) {
    const ContactForces::Result result = friction_.solve(wanted);
    solvedRows_ = state_.rows.size();
    if (result.status == SolveStatus::Invalid) return false;
    step.rubs = result.status == SolveStatus::Solved && result.friction != FrictionStatus::None;
    step.exact = findFrictionSolver(settings_.frictionSolver)->exact || result.replaced;
    step.rendered = result.x;
    if (!step.rubs || result.friction != FrictionStatus::Approximate || result.overlap <= kViolation)
        return take(result.x, result.status, result.slack, wanted, step);
    const SolveResult onto = tick_.project(result.x);
    return take(onto.x, onto.status, onto.slack, wanted, step);
}

}  // namespace touchstone
