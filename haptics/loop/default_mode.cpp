// Default mode: every leaf pair within a margin of the graphic tool becomes a half-space, the exact solver finds the
// wanted increment nearest to the device, a cap keeps it where the linearisation can be trusted, and the gaps are
// measured again.
#include <algorithm>
#include <cmath>

#include "haptics/loop/step_state.hpp"

namespace touchstone {
namespace {

constexpr int kFlights = 64;          // linearisations of a tick that carries no force
constexpr int kLeapSteps = 32;        // of one that does, while nothing is in the way of a device that leaps
constexpr int kFewSteps = 2;          // of trust: a step no longer than these is taken in them
constexpr double kLeap = 2;           // C moves this many times what the tick's linearisations can follow
constexpr int kHalvings = 24;         // 0.5 mm / 2^24 is nothing
constexpr double kBaseMargin = 0.04;  // of the margin: pairs this near have rows from the start,
constexpr int kStartRows = 4096;      // unless they are more than this many
constexpr double kArrived = 1e-3;     // mm: a step this short ends the tick
constexpr double kArc = 0.2;          // rad: flights turn no further at once, so that leaves go nearly straight
constexpr double kViolation = 1e-6;   // mm: an approximate answer that violates a row by more is projected

class DefaultTick {
  public:
    DefaultTick(Tick& tick, const Pose& device)
        : tick_(tick), s_(tick.state), set_(tick.settings), device_(device), flying_(!s_.loaded) {}

    bool run(Wrench& wrench);

  private:
    enum class Found { Failure, Free, Contact, Held };
    struct Step {
        Vec6 x;
        Vec6 rendered;      ///< x before any projection
        double length = 0;  ///< as solved, mm
        bool reachesDevice = false;
        bool elastic = false;
        double slack = 0;  ///< of an elastic answer
    };
    struct Measured {
        bool deeper = false;
        int obstacle = -1;  ///< whose `pair` is the deeper one; -1: not known
        NeighborList::Overlap pair;
        double depth = 0;  ///< greatest overlap, mm
    };

    Found findStep(const Vec6& wanted, Step& step);
    Found findClearStep(const Vec6& wanted, Step& step);
    bool fliesOn(const Vec6& wanted, Step& step);
    bool collect(double margin);
    std::array<Vec6, 2>& lastSteps() {
        return s_.lastSteps[std::min<std::size_t>(linearisation_, s_.lastSteps.size() - 1)];
    }
    /// The answer to expect: the shorter of the last two.
    const Vec6& likely() {
        const auto& [last, before] = lastSteps();
        return s_.lengthOf(last) < s_.lengthOf(before) ? last : before;
    }
    Course course(int obstacle, const Vec6& x) const;
    bool completeLists(double margin, const Vec6& x);
    bool isShort(const Vec6& x) const;
    bool isNear(double margin) const;
    Crossing trusted(const Vec6& x, double slack = 0) const;
    bool addCrossed(double upTo, const Crossing& by, bool& added);
    void truncated(int rows);
    double freeWay(const Vec6& x) const;
    bool solve(const Vec6& wanted, Step& step);
    bool solveNotDeeper(const Vec6& wanted, Vec6& x);
    Measured remeasure(const Vec6& x);
    bool stillDeeper(const Measured& measured, const Vec6& x) const;
    double move(Step step, const Vec6& wanted, bool contact);

    Tick& tick_;
    StepState::Impl& s_;
    const Settings& set_;
    const Pose device_;
    double budget_ = INFINITY, shiftBudget_ = INFINITY;  ///< travel left this tick, and that of C alone, mm
    int linearisation_ = 0;
    int pairs_ = 0;
    int solvedRows_ = 0;
    double allBelow_ = 0;  ///< every pair with a gap up to this has its row, mm
    double looked_ = 0;    ///< and every pair up to this that the answer crosses as far as trust takes it
    double free_ = 0;      ///< of a flight: nothing is in its way this far, mm
    bool flying_;          ///< the last step was a flight
    bool shadowed_ = false;
};

/// The increment x from the graphic pose.
Course DefaultTick::course(int obstacle, const Vec6& x) const {
    const auto R_OW = s_.R_WO[obstacle].transpose();
    return {s_.inObstacle(obstacle, s_.graphic), R_OW * x.head<3>(), R_OW * x.tail<3>()};
}

/// For those pairs within a margin that the step x may cross. False if there is no room.
bool DefaultTick::completeLists(double margin, const Vec6& x) {
    bool complete = true;
    for (int k = 0; k < int(s_.lists.size()) && complete; ++k) {
        NeighborList& list = s_.lists[k];
        Coverage asked{s_.inObstacle(k, s_.graphic), margin};
        if (list.isComplete(asked)) continue;
        asked = list.crossing(course(k, x), margin);
        s_.ask(asked.within);
        complete = list.complete(asked, set_.slack);
    }
    if (!complete) tick_.record.flags |= kListOverflow;
    return complete;
}

/// Whether trust does not keep a step from its end in this tick.
bool DefaultTick::isShort(const Vec6& x) const {
    return s_.lengthOf(x) <= std::min(kFewSteps, set_.linearisations - linearisation_) * set_.trust;
}

bool DefaultTick::isNear(double margin) const {
    const std::uint64_t start = tick_.now();
    bool near = false;
    for (int k = 0; k < int(s_.lists.size()) && !near; ++k) {
        const Pose X_OT = s_.inObstacle(k, s_.graphic);
        const std::optional<bool> listed = s_.lists[k].anyWithin(X_OT, margin);
        near = listed ? *listed : anyWithin(*s_.world->tool, *s_.world->obstacles[k].tree, X_OT, margin);
    }
    tick_.addTime(tick_.record.collisionUs, start);
    return near;
}

/// What is asked of a step: only as much of it is taken at once as trust allows, so that it has to mend only as much of
/// an overlap, and what it would meet further on is for the next.
Crossing DefaultTick::trusted(const Vec6& x, double slack) const {
    const double share = std::min(1.0, set_.trust / std::max(s_.lengthOf(x), 1e-300));
    return {share * x, tick_.stiffness(), share * slack, share};
}

/// The rows to begin with: of all pairs within the margin or, where overlaps are so deep that these are many, of the
/// nearest pair of each tool leaf. False if the lists have no room.
bool DefaultTick::collect(double margin) {
    const std::uint64_t start = tick_.now();
    s_.rows.clear();
    // For all that an answer may cross, too, if it is like those of the last ticks.
    const Vec6 x = trusted(likely()).x;
    bool complete = true;
    for (int k = 0; k < int(s_.lists.size()) && complete; ++k) {
        Coverage asked = s_.lists[k].crossing(course(k, x), std::min(set_.margin, s_.lengthOf(x)));
        if (!asked.course.stays() || asked.within.margin < margin) asked = {asked.course.X_OT, margin};
        s_.ask(asked.within);
        complete = s_.lists[k].complete(asked, set_.slack);
    }
    if (!complete) tick_.record.flags |= kListOverflow;
    const int most = set_.adaptiveMargin ? kStartRows : s_.rows.capacity();
    bool fits = true;
    const int n = int(s_.lists.size());
    for (int k = 0; k < n && complete && fits; ++k)
        fits = s_.lists[k].appendRows(s_.inObstacle(k, s_.graphic), s_.R_WO[k], margin, s_.rows, most);
    pairs_ = s_.rows.size();
    allBelow_ = looked_ = margin;
    if (complete && !fits) {
        s_.rows.clear();
        pairs_ = 0;
        for (int k = 0; k < n; ++k)
            pairs_ += s_.lists[k].appendNearestRows(s_.inObstacle(k, s_.graphic), s_.R_WO[k], margin, s_.rows);
        allBelow_ = -INFINITY;
        if (!set_.adaptiveMargin) {
            allBelow_ = margin;
            truncated(pairs_ - s_.rows.size());
        }
    }
    tick_.addTime(tick_.record.collisionUs, start);
    return complete;
}

void DefaultTick::truncated(int rows) {
    tick_.record.flags |= kRowsTruncated;
    tick_.record.rowsTruncated = std::max(tick_.record.rowsTruncated, rows);
}

/// Adds the rows of pairs with gap <= upTo that the answer crosses. False if the lists have no room; if the rows have
/// none, nothing is added, and it is for the re-measured gaps to shorten the step.
bool DefaultTick::addCrossed(double upTo, const Crossing& by, bool& added) {
    added = false;
    if (upTo <= allBelow_) return true;
    const std::uint64_t start = tick_.now();
    RowSet& crossed = s_.relaxed;
    crossed.clear();
    const bool complete = completeLists(upTo, by.x);
    bool fits = complete;
    for (int k = 0; k < int(s_.lists.size()) && fits; ++k)
        fits = s_.lists[k].appendCrossed(s_.inObstacle(k, s_.graphic), s_.R_WO[k], upTo, by, s_.rows, crossed);
    added = fits && crossed.size() > 0;
    if (added) s_.rows.merge(crossed);
    if (complete && !fits) truncated(1);  // at least: nobody counted on
    tick_.addTime(tick_.record.collisionUs, start);
    return complete;
}

/// How much of a step nothing is in the way of, mm, as far as it may go in this tick.
double DefaultTick::freeWay(const Vec6& x) const {
    const std::uint64_t start = tick_.now();
    const double length = s_.lengthOf(x), turn = x.tail<3>().norm();
    const double most = std::min({1.0, budget_ / length, kArc / std::max(turn, kArc)});
    double share = most;
    for (int k = 0; k < int(s_.lists.size()); ++k)
        share = freeShare(*s_.world->tool, *s_.world->obstacles[k].tree, course(k, x), s_.reach, share);
    tick_.addTime(tick_.record.collisionUs, start);
    return share * length - (share < most ? kArrived : 0);
}

/// The step towards `wanted` before any cap. Of the pairs within the margin few rows are needed: it starts with those
/// of the nearest and adds what the answer crosses, as far as trust takes it, until it crosses nothing. Nothing else
/// than the pose and `wanted` decides which these are, so a tick that begins anew comes to the same.
DefaultTick::Found DefaultTick::findStep(const Vec6& wanted, Step& step) {
    if (fliesOn(wanted, step)) return Found::Free;
    step = {wanted, wanted, s_.lengthOf(wanted), true};
    const double base = set_.adaptiveMargin ? kBaseMargin * set_.margin : set_.margin;
    if (!collect(base)) return Found::Failure;
    for (bool added = true; added;) {
        if (s_.rows.size() && !solve(wanted, step)) return Found::Failure;
        const Crossing by = trusted(step.x, step.slack);
        looked_ = std::max(looked_, std::min(set_.margin, s_.lengthOf(by.x)));
        if (!addCrossed(looked_, by, added)) return Found::Failure;
    }
    lastSteps() = {step.x, lastSteps()[0]};
    tick_.record.marginUsed = std::max(tick_.record.marginUsed, looked_);
    if (s_.rows.size() >= tick_.record.rows) {
        tick_.record.pairs = std::max(pairs_, s_.rows.size());
        tick_.record.rows = s_.rows.size();
        tick_.record.rowsScreened = s_.rows.size() ? solvedRows_ : 0;
    }
    flying_ = s_.rows.size() == 0 && !isShort(wanted) && !isNear(set_.margin);
    if (fliesOn(wanted, step)) return Found::Free;
    if (set_.shadow >= 0 && !shadowed_ && s_.rows.size()) {
        tick_.runShadow({tick_.stiffness(), wanted, &s_.rows}, step.rendered);
        shadowed_ = true;
    }
    return Found::Contact;
}

/// Whether the way to the device is a flight: straight on, as far as nothing is in the way, where the trust cap would
/// drag the tool. That is asked before the lists, which would have to be found anew.
bool DefaultTick::fliesOn(const Vec6& wanted, Step& step) {
    if (!flying_ || isShort(wanted)) return flying_ = false;
    step = {wanted, wanted, s_.lengthOf(wanted), true};
    free_ = freeWay(wanted);
    return flying_ = free_ > std::min(set_.trust, budget_ - kArrived);
}

/// A device that leaves contact in a leap would drag a tool that nothing holds, and the budget make that last: a loaded
/// tool goes on as long as no row is in the way of a trusted step straight to the device. It moves there first and
/// turns after, since turning takes from each step and hardly leaves the contact.
DefaultTick::Found DefaultTick::findClearStep(const Vec6& wanted, Step& step) {
    Vec6 way = wanted;
    const bool moves = way.head<3>().norm() > kArrived;
    if (moves) way.tail<3>().setZero();
    Found found = Found::Free;
    flying_ = true;
    if (!fliesOn(way, step)) {
        step.x = trusted(way).x;
        s_.rows.clear();
        allBelow_ = -INFINITY;
        looked_ = std::max(kBaseMargin * set_.margin, s_.lengthOf(step.x));
        bool crossed = false;
        if (!addCrossed(looked_, {step.x, tick_.stiffness()}, crossed)) return Found::Failure;
        if (crossed) return Found::Held;
        found = Found::Contact;
    }
    step.length = s_.lengthOf(wanted);
    step.reachesDevice = step.x == wanted;
    return found;
}

bool DefaultTick::solve(const Vec6& wanted, Step& step) {
    const QpProblem problem{tick_.stiffness(), wanted, &s_.rows};
    const SolverSettings limits = solverSettings(set_);
    const bool exact = solverTable()[set_.solver].exact;

    const std::uint64_t start = tick_.now();
    const QpProblem few{problem.stiffness, wanted, exact ? problem.rows : &tick_.screened(s_.rows)};
    SolveResult result = s_.renderers[set_.solver]->solve(few, limits);
    if (!exact) {
        if (kktResiduals(problem, wanted, {}).primal_mm == 0) result.x = wanted;  // no row is in the way
        if (few.rows->size() < problem.rows->size()) {
            result.kkt.primal_mm = kktResiduals(problem, result.x, {}).primal_mm;
            tick_.record.screenInexact += !RowScreen::isExact(set_.screening, result.x, s_.reach, set_.trust);
        }
    }
    solvedRows_ = few.rows->size();
    tick_.note(result);
    tick_.addTime(tick_.record.solveUs, start);
    if (result.status == SolveStatus::Invalid) return false;

    step.rendered = result.x;
    if (exact) {
        s_.rememberContacts(s_.rows, result);
    } else {
        if (tick_.audit) s_.rememberContacts(s_.rows, s_.reference->solve(problem, limits));
        if (result.kkt.primal_mm > kViolation) {
            const std::uint64_t again = tick_.now();
            const SolveResult onto = s_.projector->solve({problem.stiffness, result.x, &s_.rows}, limits);
            if (onto.status == SolveStatus::Invalid) return false;
            if (onto.status == SolveStatus::Elastic) tick_.record.flags |= kInfeasible;
            tick_.record.projection = std::max(tick_.record.projection, s_.lengthOf(onto.x - result.x));
            tick_.record.flags |= kProjected;
            result.x = onto.x;
            result.slack = onto.slack;
            result.status = onto.status;
            tick_.addTime(tick_.record.solveUs, again);
        }
    }
    step.x = result.x;
    step.length = s_.lengthOf(step.x);
    step.reachesDevice = step.x == wanted;
    step.elastic = result.status == SolveStatus::Elastic;
    step.slack = step.elastic ? result.slack : 0;
    return true;
}

/// Rows contradict each other and the softened answer deepens one: with every violated gap taken as zero, standing
/// still is feasible, and so is every answer. False if the lists have no room.
bool DefaultTick::solveNotDeeper(const Vec6& wanted, Vec6& x) {
    tick_.record.flags |= kNotDeeper;
    SolverSettings soft;
    soft.elasticWeight = set_.elasticWeight;
    for (bool added = true; added;) {
        const std::uint64_t start = tick_.now();
        s_.relaxed.clear();
        for (int i = 0; i < s_.rows.size(); ++i)
            s_.relaxed.push(s_.rows.row(i), std::max(0.0, s_.rows.gap()[i]), s_.rows.id(i));
        const SolveResult result = s_.projector->solve({tick_.stiffness(), wanted, &s_.relaxed}, soft);
        s_.rememberContacts(s_.relaxed, result);
        x = result.x;
        tick_.addTime(tick_.record.solveUs, start);
        Crossing by = trusted(x);
        by.share = 0;
        if (!addCrossed(looked_, by, added)) return false;
    }
    return true;
}

/// The listed pairs after the increment x, up to one that got deeper. Where the lists have no room, some unknown pair
/// counts as deeper.
DefaultTick::Measured DefaultTick::remeasure(const Vec6& x) {
    const std::uint64_t start = tick_.now();
    const Pose after = moved(s_.graphic, x);
    Measured m;
    m.deeper = !completeLists(s_.lengthOf(x), x) && !x.isZero(0);
    for (int k = 0; k < int(s_.lists.size()) && !m.deeper; ++k) {
        m.pair = s_.lists[k].remeasure(s_.inObstacle(k, s_.graphic), s_.inObstacle(k, after), kOverlapTolerance);
        m.depth = std::max(m.depth, m.pair.depth);
        m.deeper = m.pair.deeper();
        if (m.deeper) m.obstacle = k;
    }
    tick_.addTime(tick_.record.collisionUs, start);
    return m;
}

/// Whether the pair that an increment deepened is deepened by x as well.
bool DefaultTick::stillDeeper(const Measured& m, const Vec6& x) const {
    return s_.lists[m.obstacle].isDeeper(s_.inObstacle(m.obstacle, s_.graphic),
                                         s_.inObstacle(m.obstacle, moved(s_.graphic, x)), m.pair, kOverlapTolerance);
}

/// Caps the step by travel budget and trust, where it is not one of contact by what is free, and shortens it until no
/// listed gap got worse. Returns the length of what is left of it, mm.
double DefaultTick::move(Step step, const Vec6& wanted, bool contact) {
    const auto capped = [&](Vec6 x) {
        const double length = s_.lengthOf(x), shift = x.head<3>().norm(), reach = contact ? set_.trust : free_;
        if (length <= std::min(reach, budget_) && shift <= shiftBudget_) return x;
        step.reachesDevice = false;
        if (contact || budget_ < reach || shift > shiftBudget_) tick_.record.flags |= kCapped;
        return Vec6(x * std::min({1.0, reach / length, budget_ / length, shiftBudget_ / std::max(shift, 1e-300)}));
    };
    Vec6 x = capped(step.x);
    if (contact) {
        if (s_.rows.size() == 0) s_.contacts.clear();
        Measured measured = remeasure(x);
        if (measured.deeper && step.elastic) {
            if (!solveNotDeeper(wanted, x)) x.setZero();
            x = capped(x);
            step.reachesDevice = false;
            measured = remeasure(x);
        }
        // Most halvings are refused by the pair that refused the last, and look at no other.
        for (int i = 0; measured.deeper; ++i) {
            const bool last = i == kHalvings || measured.obstacle < 0;
            x = last ? Vec6(Vec6::Zero()) : Vec6(x / 2);
            step.reachesDevice = false;
            tick_.record.flags |= kHalved;
            if (last || !stillDeeper(measured, x)) measured = remeasure(x);
            if (last) break;
        }
        tick_.record.penetration = measured.depth;
    } else {
        s_.contacts.clear();
        tick_.record.penetration = 0;
    }
    const double length = s_.lengthOf(x);
    budget_ -= length;
    shiftBudget_ -= x.head<3>().norm();
    // Exactly the device's pose where nothing holds the tool, so that free flight gives exactly no force.
    s_.graphic = step.reachesDevice ? device_ : moved(s_.graphic, x);
    return length;
}

bool DefaultTick::run(Wrench& wrench) {
    for (int k = 0; k < int(s_.lists.size()); ++k) s_.lists[k].expect(s_.ways[k].shift, s_.ways[k].turn);
    bool leap = false;
    if (s_.loaded) {
        const double dt = 1000 / set_.rate;
        const Vec6 deviceStep = incrementBetween(s_.device, device_);
        leap = deviceStep.head<3>().norm() > kLeap * set_.linearisations * set_.trust;
        const double given = set_.travelBudget * dt + s_.obstacleTravel;
        budget_ = s_.lengthOf(deviceStep) + given;
        // Force is the stiffness times the way from C to C: a device that spins must not let the tool leap.
        shiftBudget_ = deviceStep.head<3>().norm() + given;
    }
    const int limit = s_.loaded ? set_.linearisations : kFlights;
    bool arrived = false, stuck = false, cut = false;
    for (; !arrived && !stuck && linearisation_ < (cut && leap ? kLeapSteps : limit); ++linearisation_) {
        const Vec6 wanted = incrementBetween(s_.graphic, device_);
        Step step;
        const Found found = linearisation_ < limit ? findStep(wanted, step) : findClearStep(wanted, step);
        if (found == Found::Failure) return false;
        if (found == Found::Held) break;
        if (found == Found::Free) s_.rows.clear();
        const Pose before = s_.graphic;
        const double moved = move(step, wanted, found == Found::Contact);
        // Where a tick takes many steps, they tell better than the last tick where it goes.
        for (int k = 0; k < int(s_.lists.size()) && linearisation_ >= set_.linearisations; ++k) {
            const Course way = Course::between(s_.inObstacle(k, before), s_.inObstacle(k, s_.graphic), s_.p_TC);
            s_.lists[k].expect(way.shift, way.turn);
        }
        arrived = step.length < kArrived || incrementBetween(s_.graphic, device_).isZero(0);
        stuck = std::min(moved, budget_) < kArrived;  // and the next step would be no longer
        cut = moved + kArrived < step.length;
    }
    if (!arrived) tick_.record.flags |= kUnfinished;
    tick_.record.linearisations = linearisation_;
    tick_.record.hover = s_.hoverAt(s_.graphic);

    for (int k = 0; k < int(s_.lists.size()); ++k) {
        const Pose X_OT = s_.inObstacle(k, s_.graphic);
        s_.ways[k] = Course::between(s_.ways[k].X_OT, X_OT, s_.p_TC);
        s_.ways[k].X_OT = X_OT;
    }
    const Vec6 pull = incrementBetween(device_, s_.graphic);
    wrench.force = set_.stiffness * pull.head<3>();
    wrench.torque = set_.torsion * pull.tail<3>();
    return true;
}

}  // namespace

bool defaultTick(Tick& tick, const Pose& device, Wrench& wrench) { return DefaultTick(tick, device).run(wrench); }

}  // namespace touchstone
