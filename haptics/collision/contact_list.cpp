#include "haptics/collision/contact_list.hpp"

#include <algorithm>

#include "haptics/math/tick_tuning.hpp"

namespace touchstone {
namespace {

/// The same pairs for steps that are a little longer.
Within withCurveReserve(Within within) {
    within.curve *= kCurveReserve;
    return within;
}

}  // namespace

ContactList::ContactList(std::unique_ptr<PairFinder> finder, const LookAhead& lookAhead)
    : finder_(std::move(finder)),
      wide_{finder_->entries(), finder_->entries()},
      narrow_(finder_->entries()),
      lookAhead_(lookAhead) {}

void ContactList::forget() { wide_[0].within = wide_[1].within = narrow_.within = {}; }

bool ContactList::complete(const Coverage& asked, double slack) {
    if (suspended_) return true;
    const StraightMotion& motion = asked.motion;
    // Where another thread finds entries, searches are small already, and a small reserve would only need more of them.
    slack = finder_->slack(slack) * (offered_ ? 1 : reach_);
    // The narrow set is also renewed while it is still complete, if too many of its entries are no longer near.
    const double narrow = lookAhead_.narrow * slack;
    const double off = finder_->deviationFrom(narrow_, motion), left = finder_->reserve(narrow_, asked, off);
    const bool serves = narrow_.count <= kFewEntries || (left <= kMaxReserve * narrow && off <= narrow);
    if (left >= 0 && serves) return true;

    const auto reserveOf = [&](const PairEntries& set) { return finder_->reserve(set, asked); };
    if (reserveOf(wide_[used_]) < 0 && reserveOf(wide_[1 - used_]) >= 0) used_ = 1 - used_;
    const double own = reserveOf(wide_[used_]), offered = offered_ ? reserveOf(*offered_) : -1;
    const PairEntries* from = left >= narrow ? &narrow_ : offered > own ? offered_ : &wide_[used_];
    if (!(left - narrow >= 0 || own >= 0 || offered >= 0)) {
        used_ = 1 - used_;
        PairEntries& wide = wide_[used_];
        from = &wide;
        narrow_.within = {};
        // If another thread finds entries, its next ones will soon serve, and this search may be small.
        const bool sparse = wide.count > 0 && wide.count < lookAhead_.sparse;
        const double part = std::max(wide_[0].count, wide_[1].count) > lookAhead_.dense ? 0.5 : 1;
        const double spare = offered_ ? 2 * narrow : slack * (sparse ? 2 : part),
                     ticks = offered_ ? kNarrowTicks : lookAhead_.ticks * part * reach_;
        // If the tool moves slowly, the search also covers steps as long as the motion of a tick.
        Within within = withCurveReserve(asked.within);
        if (const double tick = extent().length(tick_); tick <= slack)
            within = {within.margin, std::max(within.curve, tick * tick), std::max(within.most, tick), within.turn};
        // Deep overlaps can exceed the memory, and dense meshes the budget. The search is then repeated for this motion
        // alone, without slack.
        if (budget_) budget_->beginLookAhead();
        const bool found = finder_->find({expected(motion, ticks, spare), within.wider(spare)}, wide);
        if (!found || wide.count > lookAhead_.crowded)
            reach_ = std::max(reach_ / 2, kLeastReach);
        else if (wide.count < lookAhead_.crowded / 8)
            reach_ = std::min(2 * reach_, 1.0);
        if (!found && budget_) budget_->beginList();
        if (!found && !finder_->find(asked, wide)) return suspended_ = passes_;
    }
    // Looking ahead pays while the tool moves as expected and slowly enough that the next tick can use the set.
    // Where it is faster, the set of one tick serves all of its steps.
    Coverage next{expected(motion, kNarrowTicks, narrow), withCurveReserve(asked.within)};
    if (finder_->deviationFrom(*from, next.motion) > narrow || extent().length(next.motion) > kNarrowTicks * slack)
        next.motion = lookAhead_.wholeTicks && deviation(tick_, motion, extent()) <= narrow / 2 ? tick_ : motion;
    const auto widen = [&](Coverage& set) {
        const double reserve = finder_->reserve(*from, set);
        if (reserve >= 0) set.within = set.within.wider(std::min(narrow, reserve));
        return reserve >= 0 && finder_->reserve(set, asked) >= 0;
    };
    if (!widen(next)) widen(next = asked);
    if (from->count <= kFewEntries) next = *from;
    finder_->narrow(*from, next, narrow_, from == offered_ && from->count > lookAhead_.dense);
    return true;
}

/// The motion expected for some ticks, as far ahead as it pays, if the asked motion lies within half the slack of it;
/// otherwise the asked motion.
StraightMotion ContactList::expected(const StraightMotion& motion, double ticks, double slack) const {
    const StraightMotion tick{motion.X_OT, tick_.shift, tick_.turn};
    const double length = extent().length(tick);
    if (length * ticks < kMinLookAhead) return motion;
    const StraightMotion whole = tick.times(std::min(ticks, lookAhead_.most / length));
    return deviation(whole, motion, extent()) <= slack / 2 ? whole : motion;
}

}  // namespace touchstone
