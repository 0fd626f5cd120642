#pragma once
// A tick of default mode. Internal to step().
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "haptics/loop/tick_friction.hpp"

namespace touchstone {

/// A step up to this length ends the tick, mm. At the default stiffness 1 µm is 1 mN. A larger value leaves the tool
/// short of its place; a smaller one spends linearizations on what the hand cannot feel.
inline constexpr double kArrived = 1e-3;
/// Not the contactId() of any pair: there are at most 255 obstacles.
inline constexpr std::uint64_t kNoCarrier = ~std::uint64_t(0);

/// The pairs whose rows a linearization has dropped, see DefaultTick::dropBeside(). Three to six are usual where four
/// parts meet; a larger number makes the longest ticks longer, with a smaller one more steps end on what does not
/// touch.
struct DroppedPairs {
    std::array<std::uint64_t, 16> ids{};
    int count = 0;

    bool isFull() const { return count == int(ids.size()); }
    bool has(std::uint64_t id) const { return std::find(ids.begin(), ids.begin() + count, id) != ids.begin() + count; }
};

class DefaultTick final {
  public:
    DefaultTick(Tick& tick, const Pose& device);
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
        bool dragged = false;        ///< solved with a drag since, so that the last solve is not that of x
        bool beside = false;         ///< a short step ends on a row beside its features
        bool slowed = false;         ///< x is longer than allowed, and `part` is the answer with a drag
        Vec6 part = Vec6::Zero();
    };
    struct Measured {
        bool deeper = false;        ///< a pair got deeper
        int obstacle = -1;          ///< the obstacle of that pair; -1: not known
        ContactList::Overlap pair;  ///< the pair
        double depth = 0;           ///< greatest overlap, mm
    };

    // The tick (default_mode.cpp).
    bool isSpent() const;
    Course course(int obstacle, const Vec6& x) const;
    double allowed(const Vec6& x, double length, double turn, double ofBudget = 1) const;
    Crossing trustedPart(const Vec6& x, double slack = 0) const;
    /// Maximum rotation of a step between meshes, rad: with it no point is farther than a quarter of the distance that
    /// is kept from the straight way on which its feature is tested.
    double maxTurn() const { return std::sqrt(settings_.contactDistance / state_.reach); }
    /// Energy of the springs between the device and the tool at this pose, mJ.
    double energyAt(const Pose& pose) const {
        const Vec6 x = incrementBetween(pose, device_);
        return x.dot(tick_.stiffness().cwiseProduct(x)) / 2;
    }
    Measured remeasure(const Vec6& x);
    bool isStillDeeper(const Measured& measured, const Vec6& x) const;
    double move(Step step, const Vec6& wanted, bool contact);

    // The step of a linearization (default_step.cpp).
    Found findStep(const Vec6& wanted, Step& step);
    bool collectRows(double margin);
    template <class AddCrossed>
    Found settle(const Vec6& wanted, Step& step, AddCrossed&& addCrossed);
    bool shorten();
    bool fitsCappedSteps(const Vec6& x) const;
    bool isNear(double margin) const;
    double freeLengthOf(const Vec6& x) const;
    bool isFlight(const Vec6& wanted, Step& step);
    Found findClearStep(const Vec6& wanted, Step& step);
    bool solve(const Vec6& wanted, Step& step);
    void slowDown(const Vec6& wanted, Step& step);
    bool dropBeside(const Vec6& wanted, Step& step);
    std::optional<Vec6> slowed(const Vec6& wanted, double drag);
    bool take(const Vec6& x, SolveStatus status, double slack, const Vec6& wanted, Step& step);
    bool solveNotDeeper(const Vec6& wanted, Vec6& x);
    std::array<Vec6, 2>& lastSteps() {
        return state_.lastSteps[std::min<std::size_t>(linearization_, state_.lastSteps.size() - 1)];
    }

    // Its rows (default_rows.cpp).
    bool completeLists(double margin, const Vec6& x);
    void noteTruncated(int rows);
    bool addCrossed(double maxGap, const Crossing& by, Crossed& result);
    bool keepTouching();
    bool addTouching(const Crossing& by, Crossed& result);
    void noteTouching();
    bool isCarriedBy(const TouchingPairs& pairs) const;
    std::uint64_t carrierBeside(const Pose& at, bool& any) const;
    bool hasTwin(const Pose& at, std::uint64_t id, const ContactList::Stand& stand) const;
    bool takesBack(const Vec6& x) const;
    bool addHeldRows();
    void holdRows(const Vec6& solved, const Vec6& x);

    // Friction (default_friction.cpp).
    void addLoadedRows();
    bool solveWithFriction(const Vec6& wanted, Step& step);

    Tick& tick_;
    TickState::Impl& state_;
    const Settings& settings_;
    const Pose device_;
    TickFriction friction_;
    double trust_ = settings_.trust, margin_ = settings_.margin;
    double travelBudget_ = INFINITY;  ///< travel that this tick may still make, mm
    double shiftBudget_ = INFINITY;   ///< translation of C that this tick may still make, mm
    int linearizations_ = 0;          ///< maximum number in a tick that begins with force
    int linearization_ = 0;
    int pairs_ = 0;
    int solvedRows_ = 0;
    int rowsOfTick_ = 0;        ///< summed over the linearizations
    double allRowsTo_ = 0;      ///< every pair with a gap up to this has its row, mm
    double crossedRowsTo_ = 0;  ///< every pair with a gap up to this has its row if the trusted step crosses it, mm
    double freeLength_ = 0;     ///< of a flight: its path is free for this length, mm
    bool flying_;               ///< the next step may be a flight
    bool rests_ = false;        ///< device and obstacles are where they were in the last tick
    bool solved_ = false;       ///< the step is the answer on the present rows
    bool shadowRan_ = false;
    int reversals_ = 0;                           ///< successive steps that took back the one before
    bool cycling_ = false;                        ///< two steps of this tick led to and fro
    bool ofFeatures_ = false, ofLeaves_ = false;  ///< the tool touches an obstacle by their meshes, their spheres
    double drag_ = 1;                             ///< of the last slowed step, over that of a free tool
    bool blocked_ = false;                        ///< an obstacle moves where the tool cannot give way
    Vec6 clear_ = Vec6::Zero();                   ///< the last trial step between meshes that crossed nothing
    Vec6 lastMove_ = Vec6::Zero();                ///< the last move of this tick
    DroppedPairs dropped_;                        ///< in this linearization, see dropBeside()
};

}  // namespace touchstone
