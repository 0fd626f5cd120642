// Default mode: every leaf pair within a margin of the graphic tool becomes a half-space, the solver finds the feasible
// increment that is nearest to the device, a trust cap limits it to where the linearization is valid, and the gaps are
// measured again. Between meshes the rows are those of features that a trial step would bring too near.
#include <algorithm>
#include <cmath>

#include "haptics/loop/default_tick.hpp"

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
/// A motion of the device is a leap if C moves by more than this multiple of the travel that the tick's linearizations
/// can follow (linearisations x trust). A smaller multiple extends more ticks of ordinary fast motion; with a larger
/// one a leap of less than it drags the tool.
constexpr double kLeap = 2;
/// Maximum number of halvings of a step that would deepen an overlap; after them the tool stays. They shorten a step of
/// 0.5 mm to 3e-8 mm, far below the overlap tolerance. A smaller number stops a tool that could still move a little.
constexpr int kHalvings = 24;
/// A step between meshes up to this length ends the tick, mm, if the pairs that carry the tool are those before it and
/// the next step, shrunk by the ratio of the last two, would be shorter than kArrived. With a larger value a tool in a
/// shallow valley, where steps shrink less and less, is left farther from its place.
constexpr double kForetold = 5 * kArrived;
/// Trust between meshes, mm, whatever their clearance: rows are made where features would meet and not where they are.
/// A larger value bends further from the rows in a step; a smaller one takes more linearizations.
constexpr double kTrust = 0.25;

}  // namespace

DefaultTick::DefaultTick(Tick& tick, const Pose& device)
    : tick_(tick),
      state_(tick.state),
      settings_(tick.settings),
      device_(device),
      friction_(tick),
      flying_(!state_.loaded) {
    for (const ContactList* list : state_.lists) (list->ofFeatures() ? ofFeatures_ : ofLeaves_) = true;
    if (ofFeatures_ && !ofLeaves_) trust_ = margin_ = kTrust;
    linearizations_ = linearizationsOf(settings_, ofFeatures_ ? Geometry::Mesh : Geometry::Spheres);
}

/// Whether the tick has taken so much time that it must end.
bool DefaultTick::isSpent() const {
    return rowsOfTick_ > kTickRows || friction_.isSpent() || state_.searches->isTickSpent();
}

/// The motion of the tool in the obstacle's frame for the increment x from the graphic pose.
Course DefaultTick::course(int obstacle, const Vec6& x) const {
    if (obstacle == state_.pushing)
        return Course::between(state_.before(obstacle, state_.graphic),
                               state_.inObstacle(obstacle, moved(state_.graphic, x)), state_.p_TC);
    const auto R_OW = state_.R_WO[obstacle].transpose();
    return {state_.inObstacle(obstacle, state_.graphic), R_OW * x.head<3>(), R_OW * x.tail<3>()};
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
        // Out of what overlaps the tool has to move although that costs energy.
        const bool inside = std::any_of(state_.lists.begin(), state_.lists.end(),
                                        [](const ContactList* list) { return list->inside() > 0; });
        rests_ = ofFeatures_ && !ofLeaves_ && !inside && state_.device == device_ && state_.obstacleTravel == 0;
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
    bool arrived = false, stuck = false, shortened = false, beside = false;
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
        // A step over the border of what carries the tool leaves it beside that, and the next one leads on from there.
        // After a step too short for that, none would.
        beside = arrived && step.beside;
        arrived = arrived && !beside;
        const double least = beside ? kArrived / 10 : kArrived;
        // The next step could not be longer.
        stuck = moved < least || std::min(travelBudget_, ofFeatures_ ? shiftBudget_ : INFINITY) < kArrived;
        shortened = moved + kArrived < step.length;
    }
    if (friction_.failed() && !friction_.hold(start, wrench)) return false;
    // Linearizations that lead to and fro must not shake a device at rest.
    if (rests_ && energyAt(start) <= energyAt(state_.graphic) + tick_.stiffness()[0] * kArrived * kArrived / 2) {
        state_.graphic = start;
        arrived = !beside;
    }
    if (!arrived) tick_.record.flags |= kUnfinished;
    tick_.record.linearisations = linearization_;
    tick_.record.hover = state_.hoverAt(state_.graphic);
    if (friction_.any()) friction_.record();

    for (int k = 0; k < int(state_.lists.size()); ++k) {
        const Pose X_OT = state_.inObstacle(k, state_.graphic);
        state_.courses[k] = Course::between(state_.courses[k].X_OT, X_OT, state_.p_TC);
        state_.courses[k].X_OT = X_OT;
    }
    if (!friction_.failed()) wrench = tick_.coupling(incrementBetween(device_, state_.graphic));
    return true;
}

bool defaultTick(Tick& tick, const Pose& device, Wrench& wrench) {
    return tick.settings.loop == Loop::One ? oneLoopTick(tick, device, wrench) : DefaultTick(tick, device).run(wrench);
}

}  // namespace touchstone
