#pragma once
// What a trial is in: from the way there to a tool that stays where it belongs.
#include <array>
#include <cstdint>
#include <optional>

#include "haptics/loop/step.hpp"
#include "haptics/sandbox/scene/roles.hpp"

namespace touchstone::sandbox {

enum class Phase : std::uint8_t {
    Approach,  ///< nothing was touched yet
    Search,    ///< beside the hole: the origin further from its axis than the goal's tolerance
    Align,     ///< over the hole, not yet in it
    Insert,    ///< at least `engaged` deep, its axis along the hole's, and no further beside it than so tilted
    Seated,    ///< at the goal and let go
};
inline constexpr int kPhaseCount = 5;
const char* name(Phase phase);

/// How a trial ended.
enum class TrialEnd : std::uint8_t {
    Seated,     ///< fully in, let go, and still for the goal's hold
    Jam,        ///< the time was over while it was jammed
    Abort,      ///< drawn back after the first contact, or the device ended or failed
    TimeLimit,  ///< the time was over
};
const char* name(TrialEnd end);

struct PhaseLimits {
    double engaged = 1;        ///< mm into the hole that count as in it
    double tilt = 0.1;         ///< rad between tool and hole while it is in
    double letGoForce = 0.1;   ///< N; a hand that has let go feels no more,
    double letGoTorque = 5;    ///< nor more of this, mN·m
    double still = 0.05;       ///< mm that it may move after that,
    double stillAngle = 0.01;  ///< and turn, rad
    double leastHold = 300;    ///< ms that it stays at least, where the goal asks for less
    double jamForce = 2;       ///< N; in the hole and pressed by more,
    double jamProgress = 0.2;  ///< mm; without getting deeper by more
    double jamMs = 500;        ///< for so long is a jam, which ends when one of the two does
    double drawnBack = 15;     ///< mm above where it first touched: given up
};

/// Sees a trial tick by tick; all that it tells follows from those ticks. Where the goal has no depth there is no way
/// in to be judged: what is over it is aligned until it is seated.
class PhaseWatch {
  public:
    explicit PhaseWatch(const GoalRegion& goal, const PhaseLimits& limits = {}) : goal_(goal), limits_(limits) {}
    /// `dt`: length of the tick, ms.
    void add(const TickRecord& tick, double dt);

    Phase phase() const { return phase_; }
    /// Seated or Abort, once it is; what the time limit makes of the rest is the caller's.
    std::optional<TrialEnd> end() const { return end_; }
    bool jammed() const { return jammed_; }
    int jams() const { return jams_; }  ///< beginnings
    double milliseconds(Phase phase) const { return ms_[static_cast<std::size_t>(phase)]; }
    double elapsed() const { return elapsed_; }                      ///< ms
    std::optional<double> firstContact() const { return touched_; }  ///< ms
    double depth() const { return depth_; }                          ///< into the hole, mm; negative above it

  private:
    bool rests(const TickRecord& tick, double dt);
    Phase phaseOf(const Pose& X_GT) const;
    void watchJam(double force, double dt);

    GoalRegion goal_;
    PhaseLimits limits_;
    Phase phase_ = Phase::Approach;
    std::optional<TrialEnd> end_;
    std::array<double, kPhaseCount> ms_{};
    double elapsed_ = 0, depth_ = 0;
    std::optional<double> touched_;
    double touchedDepth_ = 0;
    std::optional<Pose> restPose_;  // where it was let go
    double restMs_ = 0;
    bool jammed_ = false;
    int jams_ = 0;
    double jamDepth_ = 0, jamMs_ = 0;  // of the deepest that it got to, and since then under force
};

}  // namespace touchstone::sandbox
