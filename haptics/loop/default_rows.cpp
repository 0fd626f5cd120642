// The rows that a step crosses, and those that are remembered from step to step.
#include <algorithm>
#include <utility>

#include "haptics/loop/default_tick.hpp"

namespace touchstone {
namespace {

/// Features are tried first if their distance is at most this multiple of the one that is kept. With a larger multiple
/// the tool is held where it no longer touches: at 1.25 a nut needs 1 % more torque. While the device rests, a tick
/// resolves no less than a micrometer anyway, and with a smaller multiple a tool whose place is off by rounding and
/// turn tests all pairs again and again.
constexpr double kTriedFirst = 1.02, kTriedFirstAtRest = 1.25;
/// A row that an earlier step of the tick ended on is dropped if another step ends on it and leaves its features
/// farther apart than this multiple of the distance that is kept. With a larger multiple the tool hovers beside what it
/// has left; with a smaller one it goes to and fro in shallow valleys for longer.
constexpr double kLeft = 5;
/// A row stands on its features if their nearest points lie outside them by at most this, mm: what a hand on springs of
/// 1 N/mm feels as 0.1 mN. With a larger value a row holds the tool beside what it has left; with a smaller one more
/// rows are dropped, and crossed again.
constexpr double kBeside = 1e-4;

}  // namespace

/// Makes the lists complete for those pairs within a margin that the step x may cross. Returns false if they overflow.
bool DefaultTick::completeLists(double margin, const Vec6& x) {
    bool complete = true;
    for (int k = 0; k < int(state_.lists.size()) && complete; ++k) {
        ContactList& list = *state_.lists[k];
        const Coverage asked = list.crossing(course(k, x), margin);
        Coverage all{state_.inObstacle(k, state_.graphic), margin + list.distance()};
        all.within.turn = asked.within.turn;
        if (k != state_.pushing && list.isComplete(all)) continue;
        state_.noteAsked(asked.within);
        complete = list.complete(asked, settings_.slack);
    }
    return complete;
}

void DefaultTick::noteTruncated(int rows) {
    tick_.record.flags |= kRowsTruncated;
    tick_.record.rowsTruncated = std::max(tick_.record.rowsTruncated, rows);
}

/// Adds the rows of pairs with gap <= maxGap that the step crosses. Returns false if the lists overflow. If the row set
/// is full, nothing is added, and the re-measured gaps have to shorten the step.
bool DefaultTick::addCrossed(double maxGap, const Crossing& by, Crossed& result) {
    result = Crossed::Nothing;
    if (maxGap <= allRowsTo_) return true;
    const std::uint64_t start = tick_.now();
    RowSet& crossed = state_.crossedRows;
    crossed.clear();
    const bool complete = completeLists(maxGap, by.x);
    if (!complete) result = Crossed::Overflow;
    for (int k = 0; k < int(state_.lists.size()) && result != Crossed::Overflow; ++k) {
        const Crossed found =
            state_.lists[k]->appendCrossed(state_.inObstacle(k, state_.graphic), state_.before(k, state_.graphic),
                                           state_.R_WO[k], maxGap, by, state_.rows, crossed);
        result = std::max(result, found);
    }
    if (result == Crossed::Rows) state_.rows.merge(crossed);
    // A lower bound, since the search stopped at the first row without room.
    if (complete && result == Crossed::Overflow) noteTruncated(1);
    tick_.addTime(tick_.record.collisionUs, start);
    return complete;
}

/// Keeps of the touching pairs those that still touch. Returns whether any does.
bool DefaultTick::keepTouching() {
    const TouchingPairs touching = std::exchange(state_.touching, {});
    for (const std::uint64_t id : touching.span()) {
        const int k = obstacleOf(id);
        const ContactList::Stand stand = state_.lists[k]->stand(state_.before(k, state_.graphic), id);
        const double most = (rests_ ? kTriedFirstAtRest : kTriedFirst) * state_.lists[k]->distance();
        if (stand.height <= most && stand.beside <= kBeside) state_.touching.push(id);
    }
    return state_.touching.count > 0;
}

/// Adds the rows of touching pairs that the step crosses.
bool DefaultTick::addTouching(const Crossing& by, Crossed& result) {
    const std::uint64_t start = tick_.now();
    RowSet& crossed = state_.crossedRows;
    crossed.clear();
    for (int k = 0; k < int(state_.lists.size()); ++k)
        result = std::max(result, state_.lists[k]->appendCrossedOf(
                                      state_.touching.span(), state_.inObstacle(k, state_.graphic),
                                      state_.before(k, state_.graphic), state_.R_WO[k], by, state_.rows, crossed));
    if (result == Crossed::Rows) state_.rows.merge(crossed);
    tick_.addTime(tick_.record.collisionUs, start);
    return true;
}

/// Notes the pairs of features that carry the tool. An approximate solver does not tell them; with friction, they have
/// rows from the beginning.
void DefaultTick::noteTouching() {
    state_.touching.clear();
    if (friction_.any() || !findSolver(settings_.solver)->exact) return;
    for (const TickState::Impl::Contact& contact : state_.contacts)
        if (state_.lists[obstacleOf(contact.id)]->ofFeatures()) state_.touching.push(contact.id);
}

/// Whether these pairs of features and no others carry the tool.
bool DefaultTick::isCarriedBy(const TouchingPairs& pairs) const {
    const auto were = pairs.span(), are = state_.touching.span();
    return !ofLeaves_ && !are.empty() && std::is_permutation(were.begin(), were.end(), are.begin(), are.end());
}

/// Among the rows that carry force, the one that stands farthest beside its features at this pose and was not dropped
/// before. any: whether one of all stands beside them.
std::uint64_t DefaultTick::carrierBeside(const Pose& at, bool& any) const {
    any = false;
    std::uint64_t worst = kNoCarrier;
    if (!ofFeatures_ || (!friction_.any() && !findSolver(settings_.solver)->exact)) return worst;
    double most = kBeside;
    for (const TickState::Impl::Contact& contact : state_.contacts) {
        const int k = obstacleOf(contact.id);
        const ContactList::Stand stand = state_.lists[k]->stand(state_.inObstacle(k, at), contact.id);
        if (stand.beside <= kBeside || hasTwin(at, contact.id, stand)) continue;
        any = true;
        if (stand.beside <= most || dropped_.has(contact.id)) continue;
        worst = contact.id;
        most = stand.beside;
    }
    return worst;
}

/// Whether another pair of features, of any obstacle, has the same foot and the same normal.
bool DefaultTick::hasTwin(const Pose& at, std::uint64_t id, const ContactList::Stand& stand) const {
    const int own = obstacleOf(id);
    for (int k = 0; k < int(state_.lists.size()); ++k) {
        ContactList::Stand like = stand;
        if (k != own) {
            like.foot = state_.X_OW[k] * (state_.X_WO[own] * stand.foot);
            like.normal = state_.X_OW[k].q * (state_.X_WO[own].q * stand.normal);
        }
        if (state_.lists[k]->hasTwin(state_.inObstacle(k, at), id, like, kBeside)) return true;
    }
    return false;
}

/// Whether x takes back more than half of the last move.
bool DefaultTick::takesBack(const Vec6& x) const {
    const Vec6 last = state_.metric().cwiseProduct(lastMove_);
    return -last.dot(x) > last.dot(lastMove_) / 2 && !lastMove_.isZero(0);
}

/// Adds the rows on which earlier steps of this tick ended. In a shallow valley each of two faces crosses only the step
/// that the other one leads to; with the rows of one at a time, the tool goes to and fro for ever. Returns whether any
/// is new.
bool DefaultTick::addHeldRows() {
    RowSet& added = state_.crossedRows;
    added.clear();
    for (int i = 0; i < state_.heldRows.size() && state_.rows.size() + added.size() < state_.rows.capacity(); ++i)
        if (state_.heldRows.gap()[i] < INFINITY && state_.rows.find(state_.heldRows.id(i)) < 0)
            added.push(state_.heldRows.row(i), state_.heldRows.gap()[i], state_.heldRows.id(i));
    state_.rows.merge(added);
    return added.size() > 0;
}

/// Remembers the rows on which the answer `solved` ends, and the earlier ones, as they are after the move x. Those of
/// features that the tool has left get an infinite gap.
void DefaultTick::holdRows(const Vec6& solved, const Vec6& x) {
    RowSet &held = state_.heldRows, &added = state_.crossedRows;
    const Pose after = moved(state_.graphic, x);
    const auto left = [&](std::uint64_t id) {
        const int k = obstacleOf(id);
        const ContactList& list = *state_.lists[k];
        return list.ofFeatures() &&
               list.gap(state_.inObstacle(k, after), toolLeafOf(id), obstacleLeafOf(id)) > kLeft * list.distance();
    };
    for (int i = 0; i < held.size(); ++i) held.gap()[i] += held.row(i).dot(x);
    added.clear();
    for (int i = 0; i < state_.rows.size(); ++i) {
        const Vec6 row = state_.rows.row(i);
        const double gap = state_.rows.gap()[i];
        if (row.dot(solved) + gap > kViolation) continue;
        if (const int at = held.find(state_.rows.id(i)); at >= 0) {
            // No trial of this step crossed a row that is as it was held. With friction, dropping them takes more
            // steps.
            const bool dropped = cycling_ && !friction_.any() && held.row(at) == row && left(state_.rows.id(i));
            for (int k = 0; k < 6; ++k) held.column(k)[at] = row[k];
            held.gap()[at] = dropped ? INFINITY : gap + row.dot(x);
        } else if (held.size() + added.size() < held.capacity()) {
            added.push(row, gap + row.dot(x), state_.rows.id(i));
        }
    }
    held.merge(added);
}

}  // namespace touchstone
