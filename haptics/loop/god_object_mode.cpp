// The god-object method of the related work, without friction (M. Ortega, S. Redon and S. Coquillart, A six
// degree-of-freedom god-object method for haptic display of rigid bodies with surface properties, 2007). Only the pairs
// that touch constrain the tool. Its motion is the one nearest to the wanted motion that brings none of them
// nearer (Gauss' principle of least constraint, here in the metric of the springs), and ends where a new pair touches.
// Unlike default mode it searches for no pairs in advance, so each new pair costs a step.
#include <algorithm>
#include <cmath>

#include "haptics/loop/distances.hpp"
#include "haptics/loop/tick_memory.hpp"
#include "haptics/math/tick_tuning.hpp"

namespace touchstone {
namespace {

/// Gap up to which a pair touches, and the gap at which the rows keep it, mm. What a turn bends has to fit between the
/// two. A larger value hovers; a smaller one shortens the turn of a step.
constexpr double kTouches = 1e-3, kKept = kTouches / 2;

/// Collects a row for every pair that touches; of too many, as in deep overlaps, for the nearest pair of each tool
/// leaf. An overlap is resolved by at most `trust` in a step. Returns false if the lists overflow.
bool collectTouching(Tick& tick) {
    TickState::Impl& s = tick.state;
    RowSet& rows = s.rows;
    rows.clear();
    bool fits = true;
    for (int k = 0; k < int(s.lists.size()); ++k) {
        const Pose X_OT = s.inObstacle(k, s.graphic);
        const Coverage asked{X_OT, kTouches};
        s.noteAsked(asked.within);
        if (!s.lists[k]->complete(asked, tick.settings.slack)) {
            tick.record.flags |= kListOverflow;
            return false;
        }
        fits = fits && s.lists[k]->appendRows(X_OT, s.R_WO[k], kTouches, rows);
    }
    int pairs = rows.size();
    if (!fits) {
        rows.clear();
        pairs = 0;
        for (int k = 0; k < int(s.lists.size()); ++k)
            pairs += s.lists[k]->appendNearestRows(s.inObstacle(k, s.graphic), s.R_WO[k], kTouches, rows);
        tick.record.flags |= kRowsTruncated;
        tick.record.rowsTruncated = std::max(tick.record.rowsTruncated, pairs - rows.size());
    }
    tick.record.pairs = std::max(tick.record.pairs, pairs);
    for (int i = 0; i < rows.size(); ++i) rows.gap()[i] = std::max(rows.gap()[i] - kKept, -tick.settings.trust);
    tick.record.rows = std::max(tick.record.rows, rows.size());
    return true;
}

}  // namespace

bool godObjectTick(Tick& tick, const Pose& device, Wrench& wrench) {
    TickState::Impl& s = tick.state;
    TickRecord& record = tick.record;
    const double maxTurn = std::sqrt(kTouches / s.reach);  // bends by reach turn²/2 = kKept
    const int limit = linearizationsOf(tick.settings, Geometry::Spheres);
    bool arrived = false;
    while (!arrived && record.linearizations < limit) {
        ++record.linearizations;
        std::uint64_t start = tick.now();
        if (!collectTouching(tick)) return false;
        tick.addTime(record.collisionUs, start);

        const Vec6 wanted = incrementBetween(s.graphic, device);
        Vec6 x = wanted;
        s.contacts.clear();
        if (s.rows.size() > 0) {
            const Tick::Solved solved = tick.solve(wanted, tick.settings.trust);
            if (solved.status == SolveStatus::Invalid) return false;
            x = solved.x;
            record.rowsScreened = std::max(record.rowsScreened, solved.rows);
            if (record.linearizations == 1 && tick.settings.shadow != kNoSolver)
                tick.runShadow({tick.stiffness(), wanted, &s.rows}, solved.rendered);
        }

        start = tick.now();
        const double length = s.lengthOf(x), turn = x.tail<3>().norm();
        double share = std::min(1.0, maxTurn / std::max(turn, 1e-300));
        for (int k = 0; k < int(s.lists.size()); ++k) {
            const auto R_OW = s.R_WO[k].transpose();
            const StraightMotion motion{s.inObstacle(k, s.graphic), R_OW * x.head<3>(), R_OW * x.tail<3>()};
            share = s.lists[k]->freeShare(motion, share);
        }
        tick.addTime(record.collisionUs, start);
        // In front of a new pair it stays so far away that rounding cannot take it inside.
        if (share < 1) share = std::max(0.0, share - kKept / 2 / std::max(length, 1e-300));
        s.graphic = share == 1 && x == wanted ? device : moved(s.graphic, share * x);
        arrived = length < kFelt;
    }
    if (!arrived && !(incrementBetween(s.graphic, device).isZero(0))) record.flags |= kUnfinished;
    record.hover = s.hoverAt(s.graphic);
    if (tick.audit) record.penetration = std::max(0.0, -trueClearance(*s.world, s.nodePose(s.graphic), 0, s.X_WO));
    wrench = tick.coupling(incrementBetween(device, s.graphic));
    return true;
}

}  // namespace touchstone
