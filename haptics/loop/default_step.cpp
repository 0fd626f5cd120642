// The step of one linearization of default mode, before any cap.
#include <algorithm>
#include <cmath>
#include <utility>

#include "haptics/loop/default_tick.hpp"

namespace touchstone {
namespace {

/// A step of at most this many trust lengths is taken as capped steps instead of a flight. A larger number takes more
/// linearizations where one flight would do; a smaller one searches the trees for the clearance of every short step.
constexpr int kCappedSteps = 2;
/// Fraction of the margin within which all pairs have rows in the first solve. The solve loop then adds the rows of
/// farther pairs that its answer crosses. With a larger fraction every solve has more rows; with a smaller one a step
/// needs more solves.
constexpr double kBaseMargin = 0.04;
/// Between meshes, a step that is not the first of its tick is not made if it is shorter than this on the rows of the
/// pairs that carried the tool, mm. With a larger value a moving tool stays behind its place, always on the same side:
/// at 1e-3 a nut turns with 0.8 % less torque. With a smaller one more steps are made.
constexpr double kTooShort = kArrived / 10;
/// Maximum rotation of one flight, rad. A flight is checked along straight paths of the leaves, with an allowance of
/// ρ angle²/2 for the bend of an arc. A larger angle makes the allowance so large that flights end early; a smaller one
/// takes more flights for a turn.
constexpr double kFlightTurn = 0.2;
/// Reach of the first trial step between meshes, mm, and the factor by which it grows while nothing new is crossed. A
/// larger first reach crosses more pairs that the answer does not come near; a smaller one takes more trials.
constexpr double kFirstReach = 0.03, kReachGrowth = 10;
/// Maximum number of solves for the drag that slows a step down. One or two are usual; with fewer, more steps go
/// straight.
constexpr int kDragSolves = 4;
/// Largest drag, and the inverse of the smallest, over that of a free tool. Rows may ask for more travel than is
/// allowed, whatever the drag; a larger one then costs digits of their forces.
constexpr double kMostDrag = 100;
/// The multiples of a step with a drag that may be allowed. Closer limits take more solves; with a lower first one a
/// longer end of the step is cut off.
constexpr double kLonger = 0.98, kShorter = 1.1;
/// Part of the tick's travel budget that a step with a drag may take. With all of it, more ticks end beside a face that
/// a feature has just left; a smaller part takes more linearizations.
constexpr double kOfBudget = 0.95;
/// Maximum number of trial steps of a linearization between meshes, after which the step is halved. Three to ten are
/// usual. A larger number makes the longest ticks longer; a smaller one shortens steps that could be made.
constexpr int kTrials = 64;
/// Factor by which the steps of a tick become shorter if the search for the pairs of one is not finished. With a larger
/// one a dense mesh moves more slowly than it could; with a smaller one more searches are made in vain.
constexpr double kShortening = 16;
/// Maximum number of rows in the first solve. Deep overlaps exceed it (a tool that starts inside lists 12,000 pairs and
/// more); then the first solve has the nearest pair of each tool leaf. A larger number makes these ticks longer; a
/// smaller one needs more solves in deep but ordinary contacts.
constexpr int kStartRows = 4096;
/// A step between meshes up to this length must not end on rows beside their features, mm: it may end the tick. With a
/// larger value rows are dropped that the next linearization would not cross.
constexpr double kShortStep = 5 * kArrived;

}  // namespace

/// Collects the rows of the first solve: those of all pairs within the margin or, if deep overlaps make these too many,
/// those of the nearest pair of each tool leaf. Returns false if the lists overflow.
bool DefaultTick::collectRows(double margin) {
    const std::uint64_t start = tick_.now();
    state_.rows.clear();
    // The lists are completed at once for the pairs that an answer like those of the last ticks would cross: the
    // shorter of the last two.
    const auto& [last, before] = lastSteps();
    const Vec6& expected = state_.lengthOf(last) < state_.lengthOf(before) ? last : before;
    const Vec6 x = trustedPart(expected).x;
    bool complete = true;
    for (int k = 0; k < int(state_.lists.size()) && complete; ++k) {
        if (state_.lists[k]->ofFeatures()) continue;  // no row of theirs stands for a pair that is near
        Coverage asked = state_.lists[k]->crossing(course(k, x), std::min(margin_, state_.lengthOf(x)));
        if (!asked.course.stays() || asked.within.margin < margin)
            asked = {asked.course.X_OT, margin + state_.lists[k]->distance()};
        state_.noteAsked(asked.within);
        complete = state_.lists[k]->complete(asked, settings_.slack);
    }
    if (!complete) tick_.record.flags |= kListOverflow;
    const int maxRows = settings_.adaptiveMargin ? kStartRows : state_.rows.capacity();
    bool fits = true;
    const int n = int(state_.lists.size());
    for (int k = 0; k < n && complete && fits; ++k)
        fits = state_.lists[k]->appendRows(state_.inObstacle(k, state_.graphic), state_.R_WO[k], margin, state_.rows,
                                           maxRows);
    pairs_ = state_.rows.size();
    allRowsTo_ = ofFeatures_ ? -INFINITY : margin;
    crossedRowsTo_ = margin;
    if (complete && !fits) {
        state_.rows.clear();
        pairs_ = 0;
        for (int k = 0; k < n; ++k)
            pairs_ += state_.lists[k]->appendNearestRows(state_.inObstacle(k, state_.graphic), state_.R_WO[k], margin,
                                                         state_.rows);
        allRowsTo_ = -INFINITY;
        if (!settings_.adaptiveMargin) {
            allRowsTo_ = margin;
            noteTruncated(pairs_ - state_.rows.size());
        }
    }
    tick_.addTime(tick_.record.collisionUs, start);
    return complete;
}

/// Finds the step toward `wanted` before any cap. Only a few of the pairs within the margin need rows: the first solve
/// has those of the nearest pairs, and rows that the trusted part of the answer crosses are added until it crosses
/// none. Those of the pairs that touched come first, since all pairs take longer to test and fewer of them are crossed
/// by a step that the first ones shorten. Only the pose, these pairs and `wanted` determine the rows.
DefaultTick::Found DefaultTick::findStep(const Vec6& wanted, Step& step) {
    if (isFlight(wanted, step)) return Found::Flight;
    step = {wanted, wanted, state_.lengthOf(wanted), true};
    const double base = settings_.adaptiveMargin ? kBaseMargin * settings_.margin : settings_.margin;
    if (!collectRows(base)) return Found::Failure;
    if (friction_.any()) addLoadedRows();
    clear_.setConstant(NAN);
    Found found = Found::Contact;
    solved_ = false;
    if (keepTouching()) {
        found = settle(wanted, step, [&](const Crossing& by, Crossed& crossed) { return addTouching(by, crossed); });
        // The other pairs would only hold the tool back.
        if (found == Found::Contact && linearization_ > 0 && solved_ && !step.elastic && step.length < kTooShort)
            return Found::Arrived;
    }
    dropped_.count = 0;
    do {
        if (found == Found::Contact)
            found = settle(wanted, step, [&](const Crossing& by, Crossed& crossed) {
                crossedRowsTo_ = std::max(crossedRowsTo_, std::min(margin_, state_.lengthOf(by.x)));
                if (!addCrossed(crossedRowsTo_, by, crossed)) return false;
                if (crossed == Crossed::Nothing) clear_ = by.x;
                return true;
            });
    } while (found == Found::Contact && dropBeside(wanted, step));
    if (found != Found::Contact) return found;
    lastSteps() = {step.x, lastSteps()[0]};
    tick_.record.marginUsed = std::max(tick_.record.marginUsed, crossedRowsTo_);
    if (state_.rows.size() >= tick_.record.rows) {
        tick_.record.pairs = std::max(pairs_, state_.rows.size());
        tick_.record.rows = state_.rows.size();
        tick_.record.rowsScreened = state_.rows.size() ? solvedRows_ : 0;
    }
    flying_ = state_.rows.size() == 0 && !fitsCappedSteps(wanted) && !isNear(settings_.margin);
    if (isFlight(wanted, step)) return Found::Flight;
    // With friction, contacts are those of the last solve, which may be that of another problem.
    if (settings_.shadow != kNoSolver && !shadowRan_ && state_.rows.size() && !(friction_.any() && step.dragged)) {
        const auto contacts = state_.forces.contacts();
        if (!friction_.any())
            tick_.runShadow(tick_.problemOf(wanted), step.rendered);
        else if (step.rubs && !contacts.empty())
            tick_.runFrictionShadow({tick_.stiffness(), wanted, contacts}, step.rendered, step.exact);
        shadowRan_ = true;
    }
    return Found::Contact;
}

/// Solves and adds the rows that the trusted part of the answer crosses, until it crosses none. addCrossed: adds them,
/// and returns false if the tick fails.
template <class AddCrossed>
DefaultTick::Found DefaultTick::settle(const Vec6& wanted, Step& step, AddCrossed&& addCrossed) {
    // Between meshes, a trial step that reaches far crosses pairs that the answer never comes near.
    double reach = ofFeatures_ ? kFirstReach : INFINITY;
    bool done = false;
    for (int trial = 0; !done && !isSpent() && (!ofFeatures_ || trial < kTrials); ++trial) {
        if (!std::exchange(solved_, false) && state_.rows.size() && !solve(wanted, step)) return Found::Failure;
        if (friction_.failed()) return Found::Blocked;
        cycling_ = cycling_ || (reversals_ > 0 && state_.rows.size() && takesBack(step.x));
        if (cycling_ && addHeldRows()) continue;
        Crossed crossed = Crossed::Nothing;
        do {
            Crossing by = step.slowed ? Crossing{step.part, tick_.stiffness()} : trustedPart(step.x, step.slack);
            const double length = state_.lengthOf(by.x);
            by.whole = length <= reach;
            if (!by.whole) by.x *= reach / length;
            if (!addCrossed(by, crossed)) {
                if (!shorten()) return Found::Failure;
                crossed = Crossed::Rows;
            }
            if (crossed == Crossed::Rows) break;
            done = by.whole || crossed == Crossed::Overflow;
            reach *= kReachGrowth;
        } while (!done);
    }
    solved_ = done;
    return Found::Contact;
}

/// Drops the row that carries force farthest beside its features at the end of a step that may end the tick. A far
/// trial crossed it, and it would hold the tool where nothing is; the trials that follow tell whether the step without
/// it is free. Each pair is dropped once. Returns whether there was one.
bool DefaultTick::dropBeside(const Vec6& wanted, Step& step) {
    if (!solved_ || step.elastic || step.length >= kShortStep) return false;
    const std::uint64_t id = carrierBeside(moved(state_.graphic, step.slowed ? step.part : step.x), step.beside);
    if (id == kNoCarrier || dropped_.isFull() || state_.rows.find(id) < 0) return false;
    dropped_.ids[dropped_.count++] = id;
    state_.rows.erase(state_.rows.find(id));
    if (const int held = state_.heldRows.find(id); held >= 0) state_.heldRows.gap()[held] = INFINITY;
    step = {wanted, wanted, state_.lengthOf(wanted), true};
    solved_ = false;
    return true;
}

/// Shortens the steps of this tick if the pairs of one were not found: fewer come near a shorter one. Returns false if
/// the tick fails.
bool DefaultTick::shorten() {
    if (ofLeaves_ || trust_ < kArrived) {
        tick_.record.flags |= kListOverflow;
        return false;
    }
    trust_ /= kShortening;
    return true;
}

/// Whether the capped steps that this tick has left can reach the end of x.
bool DefaultTick::fitsCappedSteps(const Vec6& x) const {
    return state_.lengthOf(x) <= std::min(kCappedSteps, linearizations_ - linearization_) * trust_;
}

bool DefaultTick::isNear(double margin) const {
    const std::uint64_t start = tick_.now();
    bool near = false;
    for (int k = 0; k < int(state_.lists.size()) && !near; ++k) {
        // Between meshes, a flight is tested pair by pair and may begin near a surface.
        near =
            !state_.lists[k]->ofFeatures() && state_.lists[k]->anyWithin(state_.inObstacle(k, state_.graphic), margin);
    }
    tick_.addTime(tick_.record.collisionUs, start);
    return near;
}

/// The length of the path of x that is free, mm, as far as travel budget and turn allow in one flight.
double DefaultTick::freeLengthOf(const Vec6& x) const {
    const std::uint64_t start = tick_.now();
    const double length = state_.lengthOf(x), turn = x.tail<3>().norm();
    const double allowed = std::min({1.0, travelBudget_ / length, kFlightTurn / std::max(turn, kFlightTurn)});
    double share = allowed;
    for (int k = 0; k < int(state_.lists.size()); ++k) share = state_.lists[k]->freeShare(course(k, x), share);
    tick_.addTime(tick_.record.collisionUs, start);
    return share * length - (share < allowed ? kArrived : 0);
}

/// Whether the step to the device is a flight: the tool moves along the straight path as far as it is free, where the
/// trust cap would drag it. This is tested before the lists are used, since a long step would have to rebuild them.
bool DefaultTick::isFlight(const Vec6& wanted, Step& step) {
    if (!flying_ || fitsCappedSteps(wanted) || state_.pushing >= 0) return flying_ = false;
    step = {wanted, wanted, state_.lengthOf(wanted), true};
    freeLength_ = freeLengthOf(wanted);
    return flying_ = freeLength_ > std::min(trust_, travelBudget_ - kArrived);
}

/// A device that leaps out of contact would drag a tool that nothing holds, and the travel budget would make this last.
/// A loaded tool therefore continues as long as a trusted step straight toward the device crosses no row. It
/// translates first and rotates afterwards, since a rotation takes travel from each step and hardly leaves the contact.
DefaultTick::Found DefaultTick::findClearStep(const Vec6& wanted, Step& step) {
    Vec6 path = wanted;
    const bool translates = path.head<3>().norm() > kArrived;
    if (translates) path.tail<3>().setZero();
    Found found = Found::Flight;
    flying_ = true;
    if (!isFlight(path, step)) {
        step.x = trustedPart(path).x;
        state_.rows.clear();
        allRowsTo_ = -INFINITY;
        crossedRowsTo_ = std::max(kBaseMargin * settings_.margin, state_.lengthOf(step.x));
        Crossed crossed = Crossed::Nothing;
        if (!addCrossed(crossedRowsTo_, {step.x, tick_.stiffness()}, crossed))
            return shorten() ? Found::Blocked : Found::Failure;
        if (crossed == Crossed::Rows) return Found::Blocked;
        found = Found::Contact;
    }
    step.length = state_.lengthOf(wanted);
    step.reachesDevice = step.x == wanted;
    return found;
}

bool DefaultTick::solve(const Vec6& wanted, Step& step) {
    if (friction_.any()) {
        if (!solveWithFriction(wanted, step)) return false;
    } else {
        const Tick::Solved solved = tick_.solve(wanted, trust_);
        solvedRows_ = solved.rows;
        step.rendered = solved.rendered;
        if (!take(solved.x, solved.status, solved.slack, wanted, step)) return false;
    }
    slowDown(wanted, step);
    return true;
}

/// Between meshes: if the answer is longer than a step may be, solves again with a drag on the tool, by which the
/// answer becomes as long as allowed. A part of the answer would lead straight through free space from the contacts
/// before to those after; with a drag the tool follows the surfaces.
void DefaultTick::slowDown(const Vec6& wanted, Step& step) {
    step.slowed = step.dragged = false;
    const double whole = allowed(step.x, trust_, maxTurn(), kOfBudget);
    if (whole >= kLonger || whole * step.length < kArrived || step.elastic) return;
    const bool exact = friction_.any() ? step.rubs && findFrictionSolver(settings_.frictionSolver)->exact
                                       : findSolver(settings_.solver)->exact;
    if (!ofFeatures_ || ofLeaves_ || !exact) return;
    // The multiple that is allowed is nearly linear in the drag; it is for a free tool, which nothing holds.
    const auto squared = [&](const Vec6& metric) { return step.x.dot(metric.cwiseProduct(step.x)); };
    const double free = squared(tick_.stiffness()) / squared(state_.metric()) * (1 / whole - 1);
    double drag = drag_ * free, before = 0, share = whole;
    step.dragged = true;
    for (int k = 0; k < kDragSolves && (share < kLonger || share > kShorter); ++k) {
        const std::optional<Vec6> x = slowed(wanted, drag);
        if (!x) return;
        const double last = std::exchange(share, std::min(allowed(*x, trust_, maxTurn(), kOfBudget), 1e3));
        step.part = std::min(1.0, share) * *x;
        drag_ = drag / free;
        const double slope = (share - last) / (drag - before);
        before = drag;
        const double next = slope > 0 ? drag + (1 - share) / slope : kMostDrag * free;
        drag = std::clamp(next, free / kMostDrag, free * kMostDrag);
    }
    // Where no drag is found, the tool takes the straight way rather than none.
    step.slowed = share < 2;
}

/// The answer with a drag, if there is one.
std::optional<Vec6> DefaultTick::slowed(const Vec6& wanted, double drag) {
    if (!friction_.any()) return tick_.solve(wanted, trust_, drag).x;
    const ContactForces::Result result = friction_.solve(wanted, drag);
    if (result.status != SolveStatus::Solved || result.friction == FrictionStatus::None) return std::nullopt;
    return result.x;
}

/// Makes an answer the step. Returns false if the status is Invalid.
bool DefaultTick::take(const Vec6& x, SolveStatus status, double slack, const Vec6& wanted, Step& step) {
    step.x = x;
    step.length = state_.lengthOf(x);
    step.reachesDevice = x == wanted;
    step.elastic = status == SolveStatus::Elastic;
    step.slack = step.elastic ? slack : 0;
    return status != SolveStatus::Invalid;
}

/// For rows that contradict each other, if the softened answer would deepen an overlap: solves with every negative gap
/// set to zero. Then x = 0 is feasible, and no answer deepens an overlap. Returns false if the lists overflow.
bool DefaultTick::solveNotDeeper(const Vec6& wanted, Vec6& x) {
    tick_.record.flags |= kNotDeeper;
    SolverSettings soft;
    soft.elasticWeight = settings_.elasticWeight;
    Crossed crossed = Crossed::Rows;
    for (int trial = 0; crossed == Crossed::Rows && (!ofFeatures_ || trial < kTrials); ++trial) {
        const std::uint64_t start = tick_.now();
        state_.notDeeperRows.clear();
        for (int i = 0; i < state_.rows.size(); ++i)
            state_.notDeeperRows.push(state_.rows.row(i), std::max(0.0, state_.rows.gap()[i]), state_.rows.id(i));
        const SolveResult result = state_.projector->solve({tick_.stiffness(), wanted, &state_.notDeeperRows}, soft);
        state_.rememberContacts(state_.notDeeperRows, result);
        x = result.x;
        tick_.addTime(tick_.record.solveUs, start);
        Crossing by = trustedPart(x);
        by.share = 0;
        if (!addCrossed(crossedRowsTo_, by, crossed)) return false;
    }
    return true;
}

}  // namespace touchstone
