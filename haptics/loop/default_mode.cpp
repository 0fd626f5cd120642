// Default mode: every leaf pair within a margin of the graphic tool becomes a half-space, the solver finds the feasible
// increment that is nearest to the device, a trust cap limits it to where the linearization is valid, and the gaps are
// measured again.
#include <algorithm>
#include <cmath>

#include "haptics/loop/step_state.hpp"

namespace touchstone {
namespace {

/// Maximum number of linearizations, flights included, in a tick that begins without force. It bounds the time of such
/// a tick. With a smaller number a fast device leaves the tool behind; the tick then ends kUnfinished and the next one
/// goes on.
constexpr int kFreeSteps = 64;
/// Maximum number of linearizations in a tick that begins with force, if the device leaps and nothing blocks the tool.
/// With a smaller number a device that leaps out of contact drags the tool, which the hand feels; a larger one costs
/// time.
constexpr int kLeapSteps = 32;
/// The same between meshes, as long as something blocks the tool, which then would not arrive with all of them either.
/// Each of them can take milliseconds in a thread, since successive steps of a leap share no near pairs. A larger
/// number takes a tool that slides after the device farther in that one tick.
constexpr int kBlockedLeapSteps = 3;
/// Number of rows, summed over its linearizations, with which a tick between meshes ends kUnfinished. It bounds the
/// time of a tick that follows a leap within a thread or a hole. With a smaller number ordinary ticks of fine meshes
/// end before the tool has arrived.
constexpr int kTickRows = 2048;
/// Number of evaluations by the exact solver for friction, summed over its solves, with which a tick ends kUnfinished.
/// It bounds the time of a tick in which steps lead to and fro between answers that are hard to find. Dozens are usual,
/// thousands where a tool is clamped; with a smaller number such a tool arrives later.
constexpr int kTickEvaluations = 10000;
/// A motion of the device is a leap if C moves by more than this multiple of the travel that the tick's linearizations
/// can follow (linearisations x trust). A smaller multiple extends more ticks of ordinary fast motion; with a larger
/// one a leap of less than it drags the tool.
constexpr double kLeap = 2;
/// A step of at most this many trust lengths is taken as capped steps instead of a flight. A larger number takes more
/// linearizations where one flight would do; a smaller one searches the trees for the clearance of every short step.
constexpr int kCappedSteps = 2;
/// Maximum number of halvings of a step that would deepen an overlap; after them the tool stays. They shorten a step of
/// 0.5 mm to 3e-8 mm, far below the overlap tolerance. A smaller number stops a tool that could still move a little.
constexpr int kHalvings = 24;
/// Fraction of the margin within which all pairs have rows in the first solve. The solve loop then adds the rows of
/// farther pairs that its answer crosses. With a larger fraction every solve has more rows; with a smaller one a step
/// needs more solves.
constexpr double kBaseMargin = 0.04;
/// Maximum number of rows in the first solve. Deep overlaps exceed it (a tool that starts inside lists 12,000 pairs and
/// more); then the first solve has the nearest pair of each tool leaf. A larger number makes these ticks longer; a
/// smaller one needs more solves in deep but ordinary contacts.
constexpr int kStartRows = 4096;
/// A step up to this length ends the tick, mm. At the default stiffness 1 µm is 1 mN. A larger value leaves the tool
/// short of its place; a smaller one spends linearizations on what the hand cannot feel.
constexpr double kArrived = 1e-3;
/// Between meshes, a step that is not the first of its tick is not made if it is shorter than this on the rows of the
/// pairs that carried the tool, mm. With a larger value a moving tool stays behind its place, always on the same side:
/// at 1e-3 a nut turns with 0.8 % less torque. With a smaller one more steps are made.
constexpr double kTooShort = kArrived / 10;
/// A step between meshes up to this length ends the tick, mm, if the pairs that carry the tool are those before it and
/// the next step, shrunk by the ratio of the last two, would be shorter than kArrived. With a larger value a tool in a
/// shallow valley, where steps shrink less and less, is left farther from its place.
constexpr double kForetold = 5 * kArrived;
/// Maximum rotation of one flight, rad. A flight is checked along straight paths of the leaves, with an allowance of
/// ρ angle²/2 for the bend of an arc. A larger angle makes the allowance so large that flights end early; a smaller one
/// takes more flights for a turn.
constexpr double kFlightTurn = 0.2;
/// Reach of the first trial step between meshes, mm, and the factor by which it grows while nothing new is crossed. A
/// larger first reach crosses more pairs that the answer does not come near; a smaller one takes more trials.
constexpr double kFirstReach = 0.03, kReachGrowth = 10;
/// Trust between meshes, mm, whatever their clearance: rows are made where features would meet and not where they are.
/// A larger value bends further from the rows in a step; a smaller one takes more linearizations.
constexpr double kTrust = 0.25;
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
/// Features are tried first if their distance is at most this multiple of the one that is kept. With a larger multiple
/// the tool is held where it no longer touches: at 1.25 a nut needs 1 % more torque. While the device rests, a tick
/// resolves no less than a micrometer anyway, and with a smaller multiple a tool whose place is off by rounding and
/// turn tests all pairs again and again.
constexpr double kTriedFirst = 1.02, kTriedFirstAtRest = 1.25;
/// Features that carried force still touch if their distance is at most this multiple of the one that is kept.
constexpr double kTouching = 1.001;
/// A row that an earlier step of the tick ended on is dropped if another step ends on it and leaves its features
/// farther apart than this multiple of the distance that is kept. With a larger multiple the tool hovers beside what it
/// has left; with a smaller one it goes to and fro in shallow valleys for longer.
constexpr double kLeft = 5;

class DefaultTick final : RowContacts {
  public:
    DefaultTick(Tick& tick, const Pose& device)
        : tick_(tick), state_(tick.state), settings_(tick.settings), device_(device), flying_(!state_.loaded) {
        for (const ContactList* list : state_.lists) (list->ofFeatures() ? ofFeatures_ : ofLeaves_) = true;
        if (ofFeatures_ && !ofLeaves_) trust_ = margin_ = kTrust;
        linearizations_ = linearizationsOf(settings_, ofFeatures_ ? Geometry::Mesh : Geometry::Spheres);
        rubs_ = hasFriction(*state_.world, settings_);
        if (!rubs_) state_.forces.forget();
    }

    bool run(Wrench& wrench);

  private:
    enum class Found {
        Failure,  ///< the tick fails: the tool is held without force
        Flight,   ///< a step through free space
        Contact,  ///< a step that the trust cap limits
        Blocked,  ///< no step: something is in the way
        Arrived,  ///< no step: it would be too short
    };
    struct Step {
        Vec6 x;
        Vec6 rendered;               ///< x before a projection
        double length = 0;           ///< as solved, before any cap, mm
        bool reachesDevice = false;  ///< x is the whole way to the device
        bool elastic = false;        ///< the rows contradict each other
        double slack = 0;            ///< of an elastic answer
        bool rubs = false;           ///< with friction: forces were found
        bool exact = false;          ///< with friction: by the exact solver
        bool slowed = false;         ///< x is longer than allowed, and `part` is the answer with a drag
        Vec6 part = Vec6::Zero();
    };
    struct Measured {
        bool deeper = false;        ///< a pair got deeper
        int obstacle = -1;          ///< the obstacle of that pair; -1: not known
        ContactList::Overlap pair;  ///< the pair
        double depth = 0;           ///< greatest overlap, mm
    };

    Found findStep(const Vec6& wanted, Step& step);
    template <class AddCrossed>
    Found settle(const Vec6& wanted, Step& step, AddCrossed&& addCrossed);
    bool keepTouching();
    bool addTouching(const Crossing& by, Crossed& result);
    void noteTouching();
    Found findClearStep(const Vec6& wanted, Step& step);
    bool isFlight(const Vec6& wanted, Step& step);
    bool collectRows(double margin);
    std::array<Vec6, 2>& lastSteps() {
        return state_.lastSteps[std::min<std::size_t>(linearization_, state_.lastSteps.size() - 1)];
    }
    /// The expected answer: the shorter of the last two.
    const Vec6& expectedStep() {
        const auto& [last, before] = lastSteps();
        return state_.lengthOf(last) < state_.lengthOf(before) ? last : before;
    }
    Course course(int obstacle, const Vec6& x) const;
    bool completeLists(double margin, const Vec6& x);
    bool fitsCappedSteps(const Vec6& x) const;
    bool isNear(double margin) const;
    double allowed(const Vec6& x, double length, double turn, double ofBudget = 1) const;
    Crossing trustedPart(const Vec6& x, double slack = 0) const;
    bool addCrossed(double maxGap, const Crossing& by, Crossed& result);
    void noteTruncated(int rows);
    /// Maximum rotation of a step between meshes, rad: with it no point is farther than a quarter of the distance that
    /// is kept from the straight way on which its feature is tested.
    double maxTurn() const { return std::sqrt(settings_.contactDistance / state_.reach); }
    double freeLengthOf(const Vec6& x) const;
    /// Of the springs between the device and the tool at this pose, mJ.
    double energyAt(const Pose& pose) const {
        const Vec6 x = incrementBetween(pose, device_);
        return x.dot(tick_.stiffness().cwiseProduct(x)) / 2;
    }
    /// Whether the tick has taken so much time that it must end.
    bool isSpent() const { return rowsOfTick_ > kTickRows || evaluationsOfTick_ > kTickEvaluations; }
    bool takesBack(const Vec6& x) const;
    bool addHeldRows();
    void holdRows(const Vec6& solved, const Vec6& x);
    bool solve(const Vec6& wanted, Step& step);
    void slowDown(const Vec6& wanted, Step& step);
    bool solveWithFriction(const Vec6& wanted, Step& step);
    bool take(const Vec6& x, SolveStatus status, double slack, const Vec6& wanted, Step& step);
    Place placeOf(std::uint64_t id) const noexcept override { return placeOf(id, restarted_); }
    Place placeOf(std::uint64_t id, bool restarted) const noexcept;
    void addLoadedRows();
    void recordFriction();
    bool solveNotDeeper(const Vec6& wanted, Vec6& x);
    Measured remeasure(const Vec6& x);
    bool isStillDeeper(const Measured& measured, const Vec6& x) const;
    bool isCarriedBy(const TouchingPairs& pairs) const;
    double move(Step step, const Vec6& wanted, bool contact);

    Tick& tick_;
    StepState::Impl& state_;
    const Settings& settings_;
    const Pose device_;
    double trust_ = settings_.trust, margin_ = settings_.margin;
    double travelBudget_ = INFINITY;  ///< travel that this tick may still make, mm
    double shiftBudget_ = INFINITY;   ///< translation of C that this tick may still make, mm
    int linearizations_ = 0;          ///< maximum number in a tick that begins with force
    int linearization_ = 0;
    int pairs_ = 0;
    int solvedRows_ = 0;
    int rowsOfTick_ = 0;         ///< summed over the linearizations
    int evaluationsOfTick_ = 0;  ///< by the exact solver for friction
    double allRowsTo_ = 0;       ///< every pair with a gap up to this has its row, mm
    double crossedRowsTo_ = 0;   ///< every pair with a gap up to this has its row if the trusted step crosses it, mm
    double freeLength_ = 0;      ///< of a flight: its path is free for this length, mm
    bool flying_;                ///< the next step may be a flight
    bool rests_ = false;         ///< device and obstacles are where they were in the last tick
    bool solved_ = false;        ///< the step is the answer on the present rows
    bool shadowRan_ = false;
    int reversals_ = 0;                           ///< successive steps that took back the one before
    bool cycling_ = false;                        ///< two steps of this tick led to and fro
    bool ofFeatures_ = false, ofLeaves_ = false;  ///< the tool touches an obstacle by their meshes, their spheres
    bool rubs_ = false;                           ///< there is friction
    double drag_ = 1;                             ///< of the last slowed step, over that of a free tool
    bool held_ = false;                           ///< no forces with friction were found
    bool restarted_ = false;                      ///< slip counts from restart_ and not since the tick began
    Pose restart_;
    bool blocked_ = false;          ///< an obstacle moves where the tool cannot give way
    Vec6 clear_ = Vec6::Zero();     ///< the last trial step between meshes that crossed nothing
    Vec6 lastMove_ = Vec6::Zero();  ///< the last move of this tick
};

/// The motion of the tool in the obstacle's frame for the increment x from the graphic pose.
Course DefaultTick::course(int obstacle, const Vec6& x) const {
    if (obstacle == state_.pushing)
        return Course::between(state_.before(obstacle, state_.graphic),
                               state_.inObstacle(obstacle, moved(state_.graphic, x)), state_.p_TC);
    const auto R_OW = state_.R_WO[obstacle].transpose();
    return {state_.inObstacle(obstacle, state_.graphic), R_OW * x.head<3>(), R_OW * x.tail<3>()};
}

/// Makes the lists complete for those pairs within a margin that the step x may cross. Returns false if they overflow.
bool DefaultTick::completeLists(double margin, const Vec6& x) {
    bool complete = true;
    for (int k = 0; k < int(state_.lists.size()) && complete; ++k) {
        ContactList& list = *state_.lists[k];
        Coverage asked{state_.inObstacle(k, state_.graphic), margin + list.distance()};
        if (k != state_.pushing && list.isComplete(asked)) continue;
        asked = list.crossing(course(k, x), margin);
        state_.noteAsked(asked.within);
        complete = list.complete(asked, settings_.slack);
    }
    if (!complete) tick_.record.flags |= kListOverflow;
    return complete;
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

/// The multiple of x that a step may be: of at most this length (mm) and turn (rad), within a part of the budgets.
double DefaultTick::allowed(const Vec6& x, double length, double turn, double ofBudget) const {
    return std::min({HUGE_VAL, std::min(length, ofBudget * travelBudget_) / state_.lengthOf(x),
                     ofBudget * shiftBudget_ / x.head<3>().norm(), turn / x.tail<3>().norm()});
}

/// The part of a step that trust allows in this linearization, as the test for crossed rows. That part has to resolve
/// only the same part of an overlap; what lies beyond it is left to the next linearization.
Crossing DefaultTick::trustedPart(const Vec6& x, double slack) const {
    // Between meshes the step itself is tried, so it has all its caps.
    const double share = std::min(1.0, ofFeatures_ ? allowed(x, trust_, maxTurn()) : trust_ / state_.lengthOf(x));
    return {share * x, tick_.stiffness(), share * slack, share};
}

/// Collects the rows of the first solve: those of all pairs within the margin or, if deep overlaps make these too many,
/// those of the nearest pair of each tool leaf. Returns false if the lists overflow.
bool DefaultTick::collectRows(double margin) {
    const std::uint64_t start = tick_.now();
    state_.rows.clear();
    // The lists are completed at once for the pairs that an answer like those of the last ticks would cross.
    const Vec6 x = trustedPart(expectedStep()).x;
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

/// Keeps of the touching pairs those that still touch. Returns whether any does.
bool DefaultTick::keepTouching() {
    const TouchingPairs touching = std::exchange(state_.touching, {});
    for (const std::uint64_t id : touching.span()) {
        const int k = obstacleOf(id);
        if (state_.lists[k]->touch(state_.before(k, state_.graphic), id, rests_ ? kTriedFirstAtRest : kTriedFirst))
            state_.touching.push(id);
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
    if (rubs_ || !solverTable()[settings_.solver].exact) return;
    for (const StepState::Impl::Contact& contact : state_.contacts)
        if (state_.lists[obstacleOf(contact.id)]->ofFeatures()) state_.touching.push(contact.id);
}

/// Whether these pairs of features and no others carry the tool.
bool DefaultTick::isCarriedBy(const TouchingPairs& pairs) const {
    const auto were = pairs.span(), are = state_.touching.span();
    return !ofLeaves_ && !are.empty() && std::is_permutation(were.begin(), were.end(), are.begin(), are.end());
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
        if (held_) return Found::Blocked;
        cycling_ = cycling_ || (reversals_ > 0 && state_.rows.size() && takesBack(step.x));
        if (cycling_ && addHeldRows()) continue;
        Crossed crossed = Crossed::Nothing;
        do {
            Crossing by = step.slowed ? Crossing{step.part, tick_.stiffness()} : trustedPart(step.x, step.slack);
            const double length = state_.lengthOf(by.x);
            by.whole = length <= reach;
            if (!by.whole) by.x *= reach / length;
            if (!addCrossed(by, crossed)) return Found::Failure;
            if (crossed == Crossed::Rows) break;
            done = by.whole || crossed == Crossed::Overflow;
            reach *= kReachGrowth;
        } while (!done);
    }
    solved_ = done;
    return Found::Contact;
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
    if (rubs_) addLoadedRows();
    clear_.setConstant(NAN);
    Found found = Found::Contact;
    solved_ = false;
    if (keepTouching()) {
        found = settle(wanted, step, [&](const Crossing& by, Crossed& crossed) { return addTouching(by, crossed); });
        // The other pairs would only hold the tool back.
        if (found == Found::Contact && linearization_ > 0 && solved_ && !step.elastic && step.length < kTooShort)
            return Found::Arrived;
    }
    if (found == Found::Contact)
        found = settle(wanted, step, [&](const Crossing& by, Crossed& crossed) {
            crossedRowsTo_ = std::max(crossedRowsTo_, std::min(margin_, state_.lengthOf(by.x)));
            if (!addCrossed(crossedRowsTo_, by, crossed)) return false;
            if (crossed == Crossed::Nothing) clear_ = by.x;
            return true;
        });
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
    if (settings_.shadow >= 0 && !shadowRan_ && state_.rows.size()) {
        const auto contacts = state_.forces.contacts();
        if (!rubs_)
            tick_.runShadow({tick_.stiffness(), wanted, &state_.rows}, step.rendered);
        else if (step.rubs && !contacts.empty())
            tick_.runFrictionShadow({tick_.stiffness(), wanted, contacts}, step.rendered, step.exact);
        shadowRan_ = true;
    }
    return Found::Contact;
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
        if (!addCrossed(crossedRowsTo_, {step.x, tick_.stiffness()}, crossed)) return Found::Failure;
        if (crossed == Crossed::Rows) return Found::Blocked;
        found = Found::Contact;
    }
    step.length = state_.lengthOf(wanted);
    step.reachesDevice = step.x == wanted;
    return found;
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
            const bool dropped = cycling_ && !rubs_ && held.row(at) == row && left(state_.rows.id(i));
            for (int k = 0; k < 6; ++k) held.column(k)[at] = row[k];
            held.gap()[at] = dropped ? INFINITY : gap + row.dot(x);
        } else if (held.size() + added.size() < held.capacity()) {
            added.push(row, gap + row.dot(x), state_.rows.id(i));
        }
    }
    held.merge(added);
}

bool DefaultTick::solve(const Vec6& wanted, Step& step) {
    if (rubs_) return solveWithFriction(wanted, step);
    const Tick::Solved solved = tick_.solve(wanted, trust_);
    solvedRows_ = solved.rows;
    step.rendered = solved.rendered;
    if (!take(solved.x, solved.status, solved.slack, wanted, step)) return false;
    slowDown(wanted, step);
    return true;
}

/// Between meshes: if the answer is longer than a step may be, solves again with a drag on the tool, by which the
/// answer becomes as long as allowed. A part of the answer would lead straight through free space from the contacts
/// before to those after; with a drag the tool follows the surfaces.
void DefaultTick::slowDown(const Vec6& wanted, Step& step) {
    step.slowed = false;
    const double whole = allowed(step.x, trust_, maxTurn(), kOfBudget);
    if (whole >= kLonger || whole * step.length < kArrived || step.elastic) return;
    if (!ofFeatures_ || ofLeaves_ || !solverTable()[settings_.solver].exact) return;
    // The multiple that is allowed is nearly linear in the drag; it is for a free tool, which nothing holds.
    const auto squared = [&](const Vec6& metric) { return step.x.dot(metric.cwiseProduct(step.x)); };
    const double free = squared(tick_.stiffness()) / squared(state_.metric()) * (1 / whole - 1);
    double drag = drag_ * free, before = 0, share = whole;
    for (int k = 0; k < kDragSolves && (share < kLonger || share > kShorter); ++k) {
        const Vec6 x = tick_.solve(wanted, trust_, drag).x;
        const double last = std::exchange(share, std::min(allowed(x, trust_, maxTurn(), kOfBudget), 1e3));
        step.part = std::min(1.0, share) * x;
        drag_ = drag / free;
        const double slope = (share - last) / (drag - before);
        before = drag;
        const double next = slope > 0 ? drag + (1 - share) / slope : kMostDrag * free;
        drag = std::clamp(next, free / kMostDrag, free * kMostDrag);
    }
    // Where no drag is found, the tool takes the straight way rather than none.
    step.slowed = share < 2;
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

/// restarted: whether the slip counts from restart_ and not since the tick began.
RowContacts::Place DefaultTick::placeOf(std::uint64_t id, bool restarted) const noexcept {
    const int k = obstacleOf(id);
    const Pose X_OT = state_.inObstacle(k, state_.graphic);
    const Vec3 p_O = state_.lists[k]->nearest(X_OT, toolLeafOf(id), obstacleLeafOf(id)).onTool;
    const Vec3 p_T = X_OT.inverse() * p_O;
    const Friction friction = state_.world->obstacles[k].frictionIn(settings_);
    const Pose from = restarted ? state_.inObstacle(k, restart_) : state_.courses[k].X_OT;
    return {state_.X_WO[k] * p_O - state_.graphic.p,
            from == X_OT ? Vec3::Zero() : Vec3(state_.R_WO[k] * (p_O - from * p_T)), friction.atRest, friction.sliding};
}

bool DefaultTick::solveWithFriction(const Vec6& wanted, Step& step) {
    const std::uint64_t start = tick_.now();
    const QpProblem problem{tick_.stiffness(), wanted, &state_.rows};
    const bool exact = frictionSolverTable()[settings_.frictionSolver].exact;
    FrictionSolver& solver = *state_.frictionRenderers[settings_.frictionSolver];
    solver.limitWork(settings_.solverWork);
    ContactForces::Result result =
        state_.forces.solve(problem, solverSettings(settings_), *this, *state_.projector, solver, exact);
    TickRecord& record = tick_.record;
    record.iterations += result.iterations;
    if (exact) evaluationsOfTick_ += result.iterations;
    record.status = std::max(record.status, result.status);
    solvedRows_ = state_.rows.size();
    tick_.addTime(record.solveUs, start);
    if (result.status == SolveStatus::Invalid) return false;
    if (result.status == SolveStatus::Elastic) record.flags |= kInfeasible;
    if (result.friction == FrictionStatus::Regularized) record.flags |= kFrictionSoft;
    if (result.replaced) {
        record.status = std::max(record.status, SolveStatus::IterationLimit);
        record.flags |= kIterationLimit;
    }
    if (result.restarted) {
        restarted_ = true;
        restart_ = moved(state_.graphic, result.restart);
    }
    held_ = result.status == SolveStatus::Solved && result.friction == FrictionStatus::None;
    record.coulomb = worstOf(record.coulomb, result.residuals);

    state_.contacts.clear();
    for (const ContactForces::Contact& contact : state_.forces.loaded())
        state_.contacts.push_back({contact.id, contact.normal.dot(contact.force)});
    step.rubs = result.status == SolveStatus::Solved && result.friction != FrictionStatus::None;
    step.exact = exact || result.replaced;
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
        if (!state_.world->obstacles[obstacleOf(contact.id)].frictionIn(settings_).any()) continue;
        (contact.slides ? record.sliding : record.sticking) += 1;
        const Vec3& n = contact.normal;
        const auto slipped = [&](bool restarted) {
            const Vec3 moved = placeOf(contact.id, restarted).slipped;
            return Vec3(moved - n * n.dot(moved));
        };
        record.slip = std::max(record.slip, slipped(false).norm());
        record.coulomb.dissipation_mJ -= contact.force.dot(slipped(restarted_));
        friction += contact.force - n * n.dot(contact.force);
    }
    record.frictionForce = friction.norm();
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

/// Measures the listed pairs after the increment x until one got deeper. If the lists overflow, an unknown pair counts
/// as deeper.
DefaultTick::Measured DefaultTick::remeasure(const Vec6& x) {
    const std::uint64_t start = tick_.now();
    const Pose after = moved(state_.graphic, x);
    Measured m;
    m.deeper = !completeLists(state_.lengthOf(x), x) && !x.isZero(0);
    for (int k = 0; k < int(state_.lists.size()) && !m.deeper; ++k) {
        m.pair = state_.lists[k]->remeasure(state_.before(k, state_.graphic), state_.inObstacle(k, after),
                                            kOverlapTolerance);
        m.depth = std::max(m.depth, m.pair.depth);
        m.deeper = m.pair.deeper();
        if (m.deeper) m.obstacle = k;
    }
    tick_.addTime(tick_.record.collisionUs, start);
    return m;
}

/// Whether x deepens the pair that an earlier increment deepened.
bool DefaultTick::isStillDeeper(const Measured& m, const Vec6& x) const {
    return state_.lists[m.obstacle]->isDeeper(state_.before(m.obstacle, state_.graphic),
                                              state_.inObstacle(m.obstacle, moved(state_.graphic, x)), m.pair,
                                              kOverlapTolerance);
}

/// Moves the graphic tool. Caps the step by the travel budget and by trust (a flight by its free length), and halves it
/// until no listed pair gets deeper. Returns the length of the move, mm.
double DefaultTick::move(Step step, const Vec6& wanted, bool contact) {
    const auto capped = [&](Vec6 x) {
        const double limit = contact ? trust_ : freeLength_;
        const double share = allowed(x, limit, contact && ofFeatures_ ? maxTurn() : INFINITY);
        if (share >= 1 && !step.slowed) return x;
        step.reachesDevice = false;
        if (contact || travelBudget_ < limit || x.head<3>().norm() > shiftBudget_) tick_.record.flags |= kCapped;
        return Vec6(std::min(1.0, share) * x);
    };
    const Vec6 solved = step.slowed ? step.part : step.x;
    Vec6 x = capped(solved);
    if (contact) {
        if (state_.rows.size() == 0) {
            state_.contacts.clear();
            state_.forces.clear();
        }
        // Where surfaces bend more than the springs resist, each linearization overshoots by the same ratio to the
        // last: the secant leads to where they meet.
        reversals_ = ofFeatures_ && takesBack(x) ? reversals_ + 1 : 0;
        if (reversals_ > 0 && state_.lengthOf(x) > 2 * kArrived) {
            x /= 1 + std::min(1.0, state_.lengthOf(x) / state_.lengthOf(lastMove_));
            step.reachesDevice = false;
        }
        // Between meshes, a step that is taken as it was tried crosses nothing.
        const bool tried = ofFeatures_ && !ofLeaves_ && x == clear_;
        Measured measured = tried ? Measured{} : remeasure(x);
        if (measured.deeper && step.elastic) {
            if (!solveNotDeeper(wanted, x)) x.setZero();
            x = capped(x);
            step.reachesDevice = false;
            measured = remeasure(x);
        }
        // Most halvings are refused by the pair that refused the last one, so that pair is tested first.
        for (int i = 0; measured.deeper; ++i) {
            const bool last = i == kHalvings || measured.obstacle < 0;
            x = last ? Vec6(Vec6::Zero()) : Vec6(x / 2);
            step.reachesDevice = false;
            tick_.record.flags |= kHalved;
            if (last || !isStillDeeper(measured, x)) measured = remeasure(x);
            if (last) break;
        }
        blocked_ = measured.deeper && state_.pushing >= 0;
        tick_.record.penetration = measured.depth;
    } else {
        state_.contacts.clear();
        state_.forces.clear();
        tick_.record.penetration = 0;
    }
    if (contact && ofFeatures_) {
        holdRows(solved, x);
        noteTouching();
    } else {
        state_.heldRows.clear();
        state_.touching.clear();
    }
    lastMove_ = x;
    const double length = state_.lengthOf(x);
    travelBudget_ -= length;
    shiftBudget_ -= x.head<3>().norm();
    state_.pushing = -1;
    // If nothing holds the tool, it takes exactly the device's pose, so that free flight gives exactly zero force.
    state_.graphic = step.reachesDevice ? device_ : moved(state_.graphic, x);
    return length;
}

bool DefaultTick::run(Wrench& wrench) {
    for (int k = 0; k < int(state_.lists.size()); ++k) state_.lists[k]->expect(state_.courses[k]);
    state_.heldRows.clear();
    const Pose start = state_.graphic;
    bool leap = false;
    if (state_.loaded) {
        const double dt = 1000 / settings_.rate;
        const Vec6 deviceStep = incrementBetween(state_.device, device_);
        // Out of leaves that overlap the tool has to move although that costs energy.
        rests_ = ofFeatures_ && !ofLeaves_ && state_.device == device_ && state_.obstacleTravel == 0;
        leap = deviceStep.head<3>().norm() > kLeap * linearizations_ * trust_;
        const double allowance = settings_.travelBudget * dt + state_.obstacleTravel;
        travelBudget_ = state_.lengthOf(deviceStep) + allowance;
        // The force is the stiffness times the distance between the two C, so a device that only spins must not let
        // the tool's C leap.
        shiftBudget_ = deviceStep.head<3>().norm() + allowance;
    }
    const int limit = !state_.loaded        ? kFreeSteps
                      : leap && ofFeatures_ ? std::min(linearizations_, kBlockedLeapSteps)
                                            : linearizations_;
    bool arrived = false, stuck = false, shortened = false;
    for (; !arrived && !stuck && !isSpent() && linearization_ < (shortened && leap ? kLeapSteps : limit);
         ++linearization_) {
        const Vec6 wanted = incrementBetween(state_.graphic, device_);
        const double last = state_.lengthOf(lastMove_);
        const TouchingPairs carriers = state_.touching;
        Step step;
        const Found found = linearization_ < limit ? findStep(wanted, step) : findClearStep(wanted, step);
        if (found == Found::Failure) return false;
        arrived = found == Found::Arrived;
        if (arrived || found == Found::Blocked) break;
        if (found == Found::Flight) state_.rows.clear();
        const Pose before = state_.graphic;
        const double moved = move(step, wanted, found == Found::Contact);
        if (blocked_) return false;
        // In a tick of many steps, the last step predicts the next one better than the last tick does.
        for (int k = 0; k < int(state_.lists.size()) && linearization_ >= 2; ++k) {
            const Pose X_OT = state_.inObstacle(k, state_.graphic);
            const Course lastStep = Course::between(state_.inObstacle(k, before), X_OT, state_.p_TC);
            state_.lists[k]->expect({X_OT, lastStep.shift, lastStep.turn});
        }
        if (ofFeatures_) rowsOfTick_ += state_.rows.size();
        arrived = step.length < kArrived ||
                  (step.length < kForetold && !step.elastic && isCarriedBy(carriers) &&
                   step.length - moved + step.length * (step.length / last) < kArrived) ||
                  incrementBetween(state_.graphic, device_).isZero(0);
        // The next step could not be longer.
        stuck = std::min({moved, travelBudget_, ofFeatures_ ? shiftBudget_ : INFINITY}) < kArrived;
        shortened = moved + kArrived < step.length;
    }
    if (held_) {
        // The force of the last tick holds the tool at its place inside the cones; that of the springs would not. An
        // obstacle that moved in this tick may have taken that place.
        if (state_.obstacleTravel > 0) return false;
        state_.graphic = start;
        state_.forces.restartTick();
        tick_.record.flags |= kFrictionHeld;
        wrench = state_.wrench;
        tick_.loaded = !wrench.isZero();
    }
    // Linearizations that lead to and fro must not shake a device at rest.
    if (rests_ && energyAt(start) <= energyAt(state_.graphic) + tick_.stiffness()[0] * kArrived * kArrived / 2) {
        state_.graphic = start;
        arrived = true;
    }
    if (!arrived) tick_.record.flags |= kUnfinished;
    tick_.record.linearisations = linearization_;
    tick_.record.hover = state_.hoverAt(state_.graphic);
    if (rubs_) recordFriction();

    for (int k = 0; k < int(state_.lists.size()); ++k) {
        const Pose X_OT = state_.inObstacle(k, state_.graphic);
        state_.courses[k] = Course::between(state_.courses[k].X_OT, X_OT, state_.p_TC);
        state_.courses[k].X_OT = X_OT;
    }
    if (!held_) wrench = tick_.coupling(incrementBetween(device_, state_.graphic));
    return true;
}

}  // namespace

bool defaultTick(Tick& tick, const Pose& device, Wrench& wrench) { return DefaultTick(tick, device).run(wrench); }

}  // namespace touchstone
