// Default mode, a loop from where the tool is to the pose that is nearest to the device.
//
//   repeat
//     rows := as they are at this pose, of features the known contacts that still face each other, of leaves
//             all pairs that are near                                                                      collectRows
//     without any, and with the device far: fly straight, as far as the path is free                       fly
//     repeat
//       x := the increment nearest to the device on the rows, damped until it is short enough                solve
//       sweep x over all pairs, a short part of it first: what it crosses becomes rows                    sweep
//     until x crosses nothing
//     if x is short or takes back the last step, and a row that carries it stands beside its features:
//       drop that row, and solve again                                                                    dropBeside
//     if x takes back the last step: the rows on which that step ended join for the rest of the tick      joinLastRows
//     move by x, exactly as it was swept: the rows that carry force are known contacts now                move
//   until x is too short to be felt, or the tick has spent its travel or its work
//
// A step that crosses no features leaves apart what was apart, so the tool never overlaps, wherever a tick ends. Leaves
// are round and their rows straight, so a step among them is halved until it brings none deeper. With friction, solve()
// finds the forces by Coulomb's law (TickFriction), and all else stays the same.
#include <algorithm>
#include <array>
#include <cmath>

#include "haptics/loop/setting_table.hpp"
#include "haptics/loop/tick_friction.hpp"
#include "haptics/math/tick_tuning.hpp"

namespace touchstone {
namespace {

/// All of the tick's travel, but for rounding.
constexpr double kAllTravel = 1 - 1e-9;

/// Pairs of features in ascending order. What does not fit is left out.
struct Pairs {
    std::array<std::uint64_t, 64> ids{};
    int count = 0;

    auto end() { return ids.begin() + count; }
    bool isFull() const { return count == int(ids.size()); }
    bool has(std::uint64_t id) { return std::binary_search(ids.begin(), end(), id); }
    void add(std::uint64_t id) {
        const auto at = std::lower_bound(ids.begin(), end(), id);
        if (isFull() || (at != end() && *at == id)) return;
        std::move_backward(at, end(), end() + 1);
        *at = id;
        ++count;
    }
};

class DefaultTick {
  public:
    DefaultTick(Tick& tick, const Pose& device);
    bool run(Wrench& wrench);

  private:
    enum class Found {
        Failure,  ///< the lists overflow: the tool is held without force
        Step,     ///< a step that crosses nothing
        Arrived,  ///< the known contacts leave no step that is worth it
        Held,     ///< no forces with friction were found
    };

    StraightMotion motion(int k, const Vec6& x) const;
    double allowed(const Vec6& x, double ofTravel) const;
    bool collectRows();
    bool appendRows(bool all);
    void appendFacing(int k, Pairs& facing);
    double nearLeaves() const { return (settings_.adaptiveMargin ? kNearLeaves : 1) * settings_.margin; }
    double freePartOf(const Vec6& x);
    bool fly(const Vec6& wanted);
    Found findStep(const Vec6& wanted, Vec6& x);
    SolveStatus solveOnRows(const Vec6& wanted, double damping, Vec6& x);
    bool solve(const Vec6& wanted, Vec6& x);
    bool takesBack(const Vec6& x) const;
    bool joinLastRows();
    bool completeLists(const Vec6& x);
    bool shorten();
    Crossed sweep(const Vec6& x, bool whole);
    bool deepens(const Vec6& x);
    Vec6 halved(Vec6 x);
    void takeCarefully(Vec6& x);
    int rowBeside(const Pose& at);
    bool dropBeside(const Pose& at);
    void move(const Vec6& x, const Vec6& wanted);
    /// The contacts that carry force in the last solve.
    std::span<const TickState::Impl::Contact> carriers() const {
        return exact_ ? std::span<const TickState::Impl::Contact>(state_.contacts)
                      : std::span<const TickState::Impl::Contact>();
    }
    void noteCarriers();
    void runShadow(const Vec6& wanted);
    bool isSpent() const {
        return returns_ > kReturns || pressed_ >= mostPressed_ || work_ > kWork || friction_.isSpent() ||
               state_.searches->isTickSpent();
    }

    Tick& tick_;
    TickState::Impl& state_;
    const Settings& settings_;
    const Pose device_;
    TickFriction friction_;
    Pairs known_;    ///< contacts of the last tick, and of the steps of this one
    Pairs dropped_;  ///< rows that this tick dropped since they stood beside their features
    bool exact_;     ///< the solver tells which contacts carry force
    bool ofFeatures_ = false, ofLeaves_ = false;  ///< the tool touches an obstacle by their meshes, their spheres
    double longest_ = kLongestStep;
    double travel_ = INFINITY, shift_ = INFINITY;  ///< that all points and C may still make in this tick, mm
    double damping_ = 0;                           ///< of the last damped step, N/mm
    Vec6 last_ = Vec6::Zero();                     ///< the last step
    int screened_ = 0;                             ///< rows that the last solve was given
    Vec6 rendered_ = Vec6::Zero();                 ///< the answer of the solver, before an approximate one is projected
    Vec6 undamped_ = Vec6::Zero();                 ///< the same without damping
    int steps_ = 0, returns_ = 0;
    int pairs_ = 0;                                      ///< that the rows of this pose stand for
    int pressed_ = 0;                                    ///< steps that ended on contacts
    int mostPressed_ = std::numeric_limits<int>::max();  ///< setting `linearizations`
    int work_ = 0;                                       ///< see kWork
    bool flies_ = true;                                  ///< a flight is worth a search
    /// For an answer that leads out of leaves that overlap: the part that the step is, which has to resolve only that
    /// part of an overlap; and the slack of all, mm, if the rows contradict each other.
    double share_ = 1, slack_ = 0;
    bool beside_ = false;   ///< what carries the tool stands beside its features
    bool capped_ = false;   ///< the step is shorter than the answer
    bool blocked_ = false;  ///< an obstacle moves where the tool cannot give way
    bool shadowed_ = false;
};

DefaultTick::DefaultTick(Tick& tick, const Pose& device)
    : tick_(tick),
      state_(tick.state),
      settings_(tick.settings),
      device_(device),
      friction_(tick),
      exact_(friction_.any() || findSolver(settings_.solver)->exact) {
    for (int k = 0; k < int(state_.lists.size()); ++k) state_.lists[k]->expect(state_.motions[k]);
    for (const ContactList* list : state_.lists) (list->ofFeatures() ? ofFeatures_ : ofLeaves_) = true;
    if (ofLeaves_) longest_ = settings_.trust;
    for (const std::uint64_t id : state_.touching.span()) known_.add(id);
    state_.heldRows.clear();
    state_.lastRows.clear();
    if (!state_.loaded) return;
    mostPressed_ = linearizationsOf(settings_, ofFeatures_ ? Geometry::Mesh : Geometry::Spheres);
    // What a tool in contact travels beyond its device bounds how fast the force drops where it slips off. The force is
    // that of the path of C, which must not leap where a device only spins.
    const Vec6 ofDevice = incrementBetween(state_.device, device_);
    const double allowance = settings_.travelBudget * 1000 / settings_.rate + state_.obstacleTravel;
    travel_ = state_.lengthOf(ofDevice) + allowance;
    shift_ = ofDevice.head<3>().norm() + allowance;
}

StraightMotion DefaultTick::motion(int k, const Vec6& x) const {
    if (k == state_.pushing)
        return StraightMotion::between(state_.before(k, state_.graphic), state_.inObstacle(k, moved(state_.graphic, x)),
                                       state_.p_TC);
    const auto R_OW = state_.R_WO[k].transpose();
    return {state_.inObstacle(k, state_.graphic), R_OW * x.head<3>(), R_OW * x.tail<3>()};
}

/// The multiple of x that a step may be. Its turn is so small that no point is farther than a quarter of the distance
/// that is kept from the straight path on which it is swept.
double DefaultTick::allowed(const Vec6& x, double ofTravel) const {
    return std::min(
        {HUGE_VAL, std::min(longest_, ofTravel * travel_) / state_.lengthOf(x), ofTravel * shift_ / x.head<3>().norm(),
         ofFeatures_ ? std::sqrt(settings_.contactDistance / state_.reach) / x.tail<3>().norm() : HUGE_VAL});
}

/// Makes the rows at this pose: of features the known contacts, of leaves all pairs that are near. Returns false if the
/// lists overflow.
bool DefaultTick::collectRows() {
    const std::uint64_t start = tick_.now();
    bool complete = true;
    for (int k = 0; k < int(state_.lists.size()) && complete; ++k) {
        if (state_.lists[k]->ofFeatures()) continue;
        const Coverage near{state_.inObstacle(k, state_.graphic), nearLeaves()};
        state_.noteAsked(near.within);
        complete = state_.lists[k]->complete(near, settings_.slack);
    }
    if (!complete) tick_.record.flags |= kListOverflow;
    if (complete && !appendRows(true)) appendRows(false);
    RowSet& joined = state_.crossedRows;
    joined.clear();
    for (int i = 0; i < state_.heldRows.size(); ++i)
        if (state_.rows.find(state_.heldRows.id(i)) < 0)
            joined.push(state_.heldRows.row(i), state_.heldRows.gap()[i], state_.heldRows.id(i));
    state_.rows.merge(joined);
    tick_.addTime(tick_.record.collisionUs, start);
    return complete;
}

/// all: of the leaves that are near; else of the nearest of each leaf of the tool, since deep overlaps make these too
/// many. Returns false if they are.
bool DefaultTick::appendRows(bool all) {
    state_.rows.clear();
    Pairs facing;
    bool fits = true;
    int pairs = 0;
    for (int k = 0; k < int(state_.lists.size()) && fits; ++k) {
        const ContactList& list = *state_.lists[k];
        const Pose X_OT = state_.inObstacle(k, state_.graphic);
        if (list.ofFeatures())
            appendFacing(k, facing);
        else if (all)
            fits = list.appendRows(X_OT, state_.R_WO[k], nearLeaves(), state_.rows,
                                   settings_.adaptiveMargin ? kMostLeafRows : state_.rows.capacity());
        else
            pairs += list.appendNearestRows(X_OT, state_.R_WO[k], nearLeaves(), state_.rows);
    }
    if (!fits) return false;
    known_ = facing;
    pairs_ = all ? state_.rows.size() : pairs;
    if (!all && !settings_.adaptiveMargin) {
        tick_.record.flags |= kRowsTruncated;
        tick_.record.rowsTruncated = std::max(tick_.record.rowsTruncated, pairs - state_.rows.size());
    }
    return true;
}

/// Appends the rows of the known contacts with an obstacle that still face each other.
void DefaultTick::appendFacing(int k, Pairs& facing) {
    const ContactList& list = *state_.lists[k];
    if (list.suspended()) return;
    for (const std::uint64_t id : std::span(known_.ids.data(), std::size_t(known_.count))) {
        if (obstacleOf(id) != k) continue;
        const ContactList::Stand stand = list.stand(state_.inObstacle(k, state_.graphic), id);
        // Written so that what is not finite fails.
        if (!(stand.height <= kFaces * list.distance() && stand.beside <= kBesideFeatures)) continue;
        facing.add(id);
        const Vec3 n = state_.R_WO[k] * stand.normal, r = state_.X_WO[k] * stand.foot - state_.graphic.p;
        Vec6 row;
        row << n, r.cross(n);
        state_.rows.push(row, stand.height - list.distance(), id);
    }
}

/// The part of the increment x that is free, as far as the tick may travel. The turn of a flight is bounded.
double DefaultTick::freePartOf(const Vec6& x) {
    const double length = state_.lengthOf(x), turn = x.tail<3>().norm();
    const double most =
        std::min({1.0, travel_ / length, shift_ / x.head<3>().norm(), kTurnOfFlight / std::max(turn, kTurnOfFlight)});
    double part = most;
    for (int k = 0; k < int(state_.lists.size()); ++k) part = state_.lists[k]->freeShare(motion(k, x), part);
    return part < most ? part - kFelt / length : part;
}

/// Flies straight to the device, as far as the path is free. Where it is not, the tool translates first and turns
/// afterwards, since a turn ends a flight early. Returns whether it flew farther than a step.
bool DefaultTick::fly(const Vec6& wanted) {
    if (!flies_ || state_.pushing >= 0 || state_.rows.size() > 0 || state_.lengthOf(wanted) <= kFlies * longest_)
        return false;
    const std::uint64_t start = tick_.now();
    Vec6 x = wanted;
    double part = freePartOf(x);
    if (part < 1 && x.head<3>().norm() > longest_) {
        Vec6 shift = wanted;
        shift.tail<3>().setZero();
        const double ofShift = freePartOf(shift);
        if (ofShift * state_.lengthOf(shift) > part * state_.lengthOf(x)) {
            x = shift;
            part = ofShift;
        }
    }
    tick_.addTime(tick_.record.collisionUs, start);
    flies_ = part * state_.lengthOf(x) > longest_;
    if (!flies_) return false;
    state_.contacts.clear();
    state_.forces.clear();
    capped_ = part < 1;
    move(part * x, wanted);
    return true;
}

DefaultTick::Found DefaultTick::findStep(const Vec6& wanted, Vec6& x) {
    double part = ofLeaves_ ? INFINITY : kFirstPart;
    for (int solves = 0;; ++solves) {
        if (!solve(wanted, x)) return Found::Failure;
        if (friction_.failed()) return Found::Held;
        const double length = state_.lengthOf(x);
        // The other pairs would only hold the tool back.
        if (solves == 0 && state_.rows.size() > 0 && length < (steps_ == 0 ? kRests : kUnmoved) && state_.pushing < 0) {
            if (dropBeside(state_.graphic)) continue;
            if (!beside_) return Found::Arrived;
        }
        bool whole = false;
        Crossed crossed = Crossed::Nothing;
        while (!whole && crossed != Crossed::Rows) {
            whole = length <= 2 * part;
            crossed = sweep(whole ? x : Vec6(part / length * x), whole);
            if (crossed == Crossed::Overflow) {
                if (!shorten()) return Found::Failure;
                crossed = Crossed::Rows;  // a solve makes the step shorter
            }
            if (crossed != Crossed::Rows) part = INFINITY;
        }
        if (crossed == Crossed::Nothing) {
            const bool goesBack = takesBack(x);
            returns_ += goesBack;
            if ((length < kMayEnd || goesBack) && dropBeside(moved(state_.graphic, x))) continue;
            if (goesBack && joinLastRows()) continue;
            // Leaves are round, and a row of theirs is right at one pose only.
            if (ofLeaves_) takeCarefully(x);
            // Rows turn with the tool, and where they turn more than the springs resist each step overshoots.
            if (goesBack) x = halved(x / 2);
            return Found::Step;
        }
        // No row leads on where the rows contradict each other.
        if (crossed == Crossed::Known || solves >= kSolvesOfStep || friction_.isSpent()) {
            takeCarefully(x);
            return Found::Step;
        }
    }
}

SolveStatus DefaultTick::solveOnRows(const Vec6& wanted, double damping, Vec6& x) {
    if (state_.rows.size() == 0) {
        state_.contacts.clear();
        state_.forces.clear();
        screened_ = 0;
        x = tick_.problemOf(wanted, damping).wanted;
        return SolveStatus::Solved;
    }
    if (!friction_.any()) {
        const Tick::Solved solved = tick_.solve(wanted, longest_, damping);
        x = solved.x;
        rendered_ = solved.rendered;
        screened_ = solved.rows;
        slack_ = solved.slack;
        return solved.status;
    }
    const ContactForces::Result result = friction_.solve(wanted, damping);
    // No forces hold the tool with this much damping: the step is a part of the answer before.
    if (damping > 0 && result.status == SolveStatus::Solved && result.friction == FrictionStatus::None)
        return result.status;
    x = rendered_ = result.x;
    screened_ = state_.rows.size();
    slack_ = result.slack;
    if (result.status == SolveStatus::Invalid || result.friction != FrictionStatus::Approximate ||
        result.overlap <= kViolation)
        return result.status;
    const SolveResult onto = tick_.project(x);
    x = onto.x;
    slack_ = onto.slack;
    return onto.status;
}

/// Finds the increment nearest to the device on the rows. If it is longer than a step may be, damping λ(|δp|² +
/// ρ²|δθ|²)/2 makes it as long: the tool then follows the surfaces, where a part of the increment would lead through
/// free space. Returns false if there is none.
bool DefaultTick::solve(const Vec6& wanted, Vec6& x) {
    beside_ = capped_ = false;
    share_ = 1;
    SolveStatus status = SolveStatus::Solved;
    const auto nearest = [&](double damping) {
        status = solveOnRows(wanted, damping, x);
        // Where leaves overlap, the softened answer leads out.
        if (status == SolveStatus::Elastic && !(ofLeaves_ && !deepens(std::min(1.0, allowed(x, kAllTravel)) * x))) {
            // With no negative gap the tool can stay where it is, and no answer deepens what is too near.
            tick_.record.flags |= kNotDeeper;
            for (int i = 0; i < state_.rows.size(); ++i) state_.rows.gap()[i] = std::max(0.0, state_.rows.gap()[i]);
            status = solveOnRows(wanted, damping, x);
            share_ = 0;
        }
        if (status != SolveStatus::Elastic) slack_ = 0;
        return status != SolveStatus::Invalid;
    };
    if (!nearest(0)) return false;
    if (friction_.failed()) return true;
    undamped_ = rendered_;
    double share = allowed(x, kOfTravel);
    if (share >= kSlightlyLong) return true;
    capped_ = true;
    // Where the tool may not travel any more, no damping is strong enough.
    const int solves = share * state_.lengthOf(x) < kFelt || status == SolveStatus::Elastic ? 0 : kSolvesForDamping;
    // For a free tool the answer is that of the springs times γ/(γ + λ).
    double damping = 0;
    for (int i = 0; i < solves && !(share >= kSlightlyLong && share <= kSlightlyShort); ++i) {
        const double gamma = x.dot(tick_.stiffness().cwiseProduct(x)) / x.dot(state_.metric().cwiseProduct(x));
        damping = i == 0 && damping_ > 0 ? damping_ : std::max(0.0, (damping + gamma) / share - gamma);
        if (!nearest(damping)) return false;
        share = allowed(x, kOfTravel);
    }
    damping_ = damping;
    const double part = std::clamp(allowed(x, kAllTravel), 0.0, 1.0);
    x *= part;
    share_ *= part;
    return true;
}

/// Whether x takes back more than half of the last step.
bool DefaultTick::takesBack(const Vec6& x) const {
    const Vec6 last = state_.metric().cwiseProduct(last_);
    return !last_.isZero(0) && -last.dot(x) > last.dot(last_) / 2;
}

/// In a shallow valley each of two faces crosses only the step that the other one leads to. Returns whether a row is
/// new.
bool DefaultTick::joinLastRows() {
    RowSet& added = state_.crossedRows;
    const auto addTo = [&](RowSet& rows) {
        added.clear();
        for (int i = 0; i < state_.lastRows.size() && rows.size() + added.size() < rows.capacity(); ++i)
            if (rows.find(state_.lastRows.id(i)) < 0)
                added.push(state_.lastRows.row(i), state_.lastRows.gap()[i], state_.lastRows.id(i));
        rows.merge(added);
        return added.size() > 0;
    };
    addTo(state_.heldRows);
    return addTo(state_.rows);
}

/// Makes the lists complete for the pairs that the step x may cross. Returns false if they overflow.
bool DefaultTick::completeLists(const Vec6& x) {
    for (int k = 0; k < int(state_.lists.size()); ++k) {
        ContactList& list = *state_.lists[k];
        const double margin = state_.lengthOf(x);
        const Coverage asked = list.coverageOf(motion(k, x), margin);
        Coverage all{state_.inObstacle(k, state_.graphic), margin + list.distance()};
        all.within.turn = asked.within.turn;
        if (k != state_.pushing && list.isComplete(all)) continue;
        state_.noteAsked(asked.within);
        if (!list.complete(asked, settings_.slack)) return false;
    }
    return true;
}

/// Makes the steps of this tick shorter. Returns false if none is left.
bool DefaultTick::shorten() {
    if (longest_ < kFelt) {
        tick_.record.flags |= kListOverflow;
        return false;
    }
    longest_ /= kShortenedBy;
    return true;
}

/// Makes rows of what x crosses, the deepest half. whole: it is the step, and not a part of it.
Crossed DefaultTick::sweep(const Vec6& x, bool whole) {
    const std::uint64_t start = tick_.now();
    RowSet& crossed = state_.crossedRows;
    crossed.clear();
    Crossed result = completeLists(x) ? Crossed::Nothing : Crossed::Overflow;
    const Crossing by{x, tick_.stiffness(), ofLeaves_ ? share_ * slack_ : 0, ofLeaves_ ? share_ : 1, whole};
    for (int k = 0; k < int(state_.lists.size()) && result != Crossed::Overflow; ++k) {
        result = std::max(result, state_.lists[k]->appendCrossed(state_.inObstacle(k, state_.graphic),
                                                                 state_.before(k, state_.graphic), state_.R_WO[k],
                                                                 state_.lengthOf(x), by, state_.rows, crossed));
    }
    if (result == Crossed::Rows) state_.rows.merge(crossed);
    work_ += kWorkOfSweep + state_.rows.size();
    tick_.record.marginUsed = std::max(tick_.record.marginUsed, state_.lengthOf(x));
    tick_.addTime(tick_.record.collisionUs, start);
    return result;
}

/// Whether x brings a pair nearer than half the distance that is kept, and nearer than it is. Notes how deep leaves
/// are.
bool DefaultTick::deepens(const Vec6& x) {
    const std::uint64_t start = tick_.now();
    const Pose after = moved(state_.graphic, x);
    bool deeper = !completeLists(x);
    double depth = 0;
    for (int k = 0; k < int(state_.lists.size()) && !deeper; ++k) {
        const ContactList::Overlap overlap = state_.lists[k]->remeasure(state_.before(k, state_.graphic),
                                                                        state_.inObstacle(k, after), kOverlapTolerance);
        depth = std::max(depth, overlap.depth);
        deeper = overlap.deeper;
    }
    tick_.record.penetration = depth;
    work_ += kWorkOfSweep + state_.rows.size();
    tick_.addTime(tick_.record.collisionUs, start);
    return deeper;
}

/// The longest of x, x/2, x/4, ... that deepens nothing.
Vec6 DefaultTick::halved(Vec6 x) {
    bool deeper = true;
    for (int i = 0; i < kHalvesOfStep && deeper; ++i, x /= deeper ? 2 : 1) deeper = deepens(x);
    blocked_ = deeper && state_.pushing >= 0;
    return deeper ? Vec6(Vec6::Zero()) : x;
}

/// Shortens x, which no sweep has shown to be free, until it may be made.
void DefaultTick::takeCarefully(Vec6& x) {
    const Vec6 whole = x;
    x = halved(x);
    if (x == whole && ofLeaves_) return;
    tick_.record.flags |= kHalved;
    capped_ = true;
}

/// The row that carries force farthest beside its features with the tool at `at` and was not dropped before; -1: none.
/// Notes whether any row with force stands beside its features.
int DefaultTick::rowBeside(const Pose& at) {
    beside_ = false;
    double most = kBesideFeatures;
    int worst = -1;
    for (const TickState::Impl::Contact& contact : carriers()) {
        const int own = obstacleOf(contact.id);
        const ContactList::Stand stand = state_.lists[own]->stand(state_.inObstacle(own, at), contact.id);
        if (stand.beside <= kBesideFeatures) continue;
        bool twin = false;
        for (int k = 0; k < int(state_.lists.size()) && !twin; ++k) {
            ContactList::Stand like = stand;
            if (k != own) {
                like.foot = state_.X_OW[k] * (state_.X_WO[own] * stand.foot);
                like.normal = state_.X_OW[k].q * (state_.X_WO[own].q * stand.normal);
            }
            twin = state_.lists[k]->hasTwin(state_.inObstacle(k, at), contact.id, like, kBesideFeatures);
        }
        if (twin) continue;
        beside_ = true;
        if (stand.beside <= most || dropped_.isFull() || dropped_.has(contact.id)) continue;
        most = stand.beside;
        worst = state_.rows.find(contact.id);
    }
    return worst;
}

/// Drops that row: a long step crossed it, and it would hold the tool where nothing is. Each is dropped once in a tick.
/// Returns whether there was one.
bool DefaultTick::dropBeside(const Pose& at) {
    const int row = rowBeside(at);
    if (row < 0) return false;
    const std::uint64_t id = state_.rows.id(row);
    dropped_.add(id);
    for (RowSet* rows : {&state_.rows, &state_.heldRows, &state_.lastRows})
        if (const int found = rows->find(id); found >= 0) rows->erase(found);
    return true;
}

/// An approximate solver does not tell; then they are the rows on which the last step ended.
void DefaultTick::noteCarriers() {
    state_.touching.clear();
    const auto add = [&](std::uint64_t id) {
        if (state_.lists[obstacleOf(id)]->ofFeatures()) state_.touching.push(id);
    };
    for (const TickState::Impl::Contact& contact : carriers()) add(contact.id);
    for (int i = 0; i < state_.lastRows.size() && !exact_; ++i) add(state_.lastRows.id(i));
}

void DefaultTick::move(const Vec6& x, const Vec6& wanted) {
    for (int i = 0; i < state_.heldRows.size(); ++i) state_.heldRows.gap()[i] += state_.heldRows.row(i).dot(x);
    state_.lastRows.clear();
    for (int i = 0; i < state_.rows.size() && state_.lastRows.size() < state_.lastRows.capacity(); ++i)
        if (const double gap = state_.rows.gap()[i] + state_.rows.row(i).dot(x); gap <= kViolation)
            state_.lastRows.push(state_.rows.row(i), gap, state_.rows.id(i));
    noteCarriers();
    for (const std::uint64_t id : state_.touching.span()) known_.add(id);
    last_ = x;
    travel_ -= state_.lengthOf(x);
    work_ += int(kWorkOfTravel * std::min(state_.lengthOf(x), longest_) * (kWorkOfSweep + state_.rows.size()));
    shift_ -= x.head<3>().norm();
    state_.pushing = -1;
    if (capped_) tick_.record.flags |= kCapped;
    // If nothing holds the tool, it takes exactly the device's pose, so that free flight gives exactly zero force.
    state_.graphic = x == wanted ? device_ : moved(state_.graphic, x);
    ++steps_;
    pressed_ += state_.lastRows.size() > 0;
}

/// Once a tick. With friction, the contacts are those of the last solve, which must not be damped.
void DefaultTick::runShadow(const Vec6& wanted) {
    if (settings_.shadow == kNoSolver || shadowed_ || state_.rows.size() == 0) return;
    if (!friction_.any()) {
        tick_.runShadow(tick_.problemOf(wanted), undamped_);
    } else {
        const auto contacts = state_.forces.contacts();
        if (capped_ || contacts.empty()) return;
        const bool exact = findFrictionSolver(settings_.frictionSolver)->exact;
        tick_.runFrictionShadow({tick_.stiffness(), wanted, contacts}, undamped_, exact);
    }
    shadowed_ = true;
}

bool DefaultTick::run(Wrench& wrench) {
    TickRecord& record = tick_.record;
    const Pose start = state_.graphic;
    bool arrived = false, stuck = false;
    while (!arrived && !stuck && !isSpent()) {
        if (steps_ >= 2)  // In a tick of many steps the last one predicts the next better than the last tick does.
            for (int k = 0; k < int(state_.lists.size()); ++k) state_.lists[k]->expect(motion(k, last_));
        const Vec6 wanted = incrementBetween(state_.graphic, device_);
        state_.rows.clear();
        // The pairs that are near need not be known for a flight.
        const bool flown = steps_ == 0 && !state_.loaded && fly(wanted);
        if (!flown && !collectRows()) return false;
        if (flown || fly(wanted)) {
            arrived = state_.graphic == device_;
            stuck = std::min(travel_, shift_) < kFelt;
            continue;
        }
        Vec6 x = Vec6::Zero();
        const Found found = findStep(wanted, x);
        if (found == Found::Failure || blocked_) return false;
        if (state_.rows.size() >= record.rows) {
            record.pairs = std::max(pairs_, state_.rows.size());
            record.rows = state_.rows.size();
            record.rowsScreened = screened_;
        }
        if (found == Found::Held) break;
        runShadow(wanted);
        arrived = found == Found::Arrived;
        if (arrived) {
            if (exact_) noteCarriers();
            break;
        }
        move(x, wanted);
        flies_ = state_.rows.size() == 0;
        const double length = state_.lengthOf(x);
        arrived = (length < kFelt && !capped_) || state_.graphic == device_;
        if (arrived) rowBeside(state_.graphic);
        arrived = arrived && !beside_;
        // The next step could not be longer.
        stuck = length < (beside_ ? kUnmoved : kFelt) || std::min(travel_, shift_) < kFelt;
    }
    if (friction_.failed() && !friction_.hold(start, wrench)) return false;
    if (!arrived) record.flags |= kUnfinished;
    record.linearizations = steps_;
    record.hover = state_.hoverAt(state_.graphic);
    if (friction_.any()) friction_.record();
    for (int k = 0; k < int(state_.lists.size()); ++k) {
        const Pose X_OT = state_.inObstacle(k, state_.graphic);
        state_.motions[k] = StraightMotion::between(state_.motions[k].X_OT, X_OT, state_.p_TC);
        state_.motions[k].X_OT = X_OT;
    }
    if (!friction_.failed()) wrench = tick_.coupling(incrementBetween(device_, state_.graphic));
    return true;
}

}  // namespace

bool defaultTick(Tick& tick, const Pose& device, Wrench& wrench) { return DefaultTick(tick, device).run(wrench); }

}  // namespace touchstone
