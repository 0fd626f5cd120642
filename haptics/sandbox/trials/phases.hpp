#pragma once
// Phases of a trial, from the approach to the seated tool.
#include <array>
#include <cstdint>
#include <optional>

#include "haptics/loop/step.hpp"
#include "haptics/sandbox/scene/roles.hpp"

namespace touchstone::sandbox {

enum class Phase : std::uint8_t {
    Approach,  ///< before the first contact
    Search,    ///< beside the hole: the origin is farther from its axis than the goal's tolerance
    Align,     ///< over the hole, not yet in it
    Insert,    ///< at least `engaged` deep, with axis and origin within the tilt limit of the hole's axis
    Seated,    ///< at the goal and released
};
inline constexpr int kPhaseCount = 5;
const char* name(Phase phase);

/// How a trial ended.
enum class TrialEnd : std::uint8_t {
    Seated,     ///< at the goal, released, and at rest for the goal's hold time
    Jam,        ///< jammed at the time limit
    Abort,      ///< retracted after the first contact, or the device ended or failed
    TimeLimit,  ///< not finished at the time limit
};
const char* name(TrialEnd end);

struct PhaseLimits {
    double engaged = 1;          ///< mm: depth in the hole from which the tool counts as inserted
    double tilt = 0.1;           ///< rad: largest angle between tool and hole while inserted
    double releaseForce = 0.1;   ///< N: largest force of a released tool
    double releaseTorque = 5;    ///< mN·m: largest torque of a released tool
    double restMotion = 0.05;    ///< mm: largest motion of a tool at rest
    double restRotation = 0.01;  ///< rad: largest rotation of a tool at rest
    double minHold = 300;        ///< ms: shortest rest, even if the goal's hold time is shorter
    double jamForce = 2;         ///< N: an inserted tool is jammed if pressed by more than this
    double jamProgress = 0.2;    ///< mm: ... without getting deeper by more than this
    double jamMs = 500;          ///< ms: ... for this long; the jam ends with either condition
    double retraction = 15;      ///< mm: retracting this far above the first contact aborts the trial
};

/// Determines the phase of a trial tick by tick, from the ticks alone. A goal without depth has no insertion: a tool
/// over it is aligned until it is seated.
class PhaseWatch {
  public:
    explicit PhaseWatch(const GoalRegion& goal, const PhaseLimits& limits = {})
        : goal_(goal), limits_(limits), out_(goal.outAtStart()) {}
    /// `dt`: length of the tick, ms.
    void add(const TickRecord& tick, double dt);

    Phase phase() const { return phase_; }
    /// Seated or Abort, once reached. The caller applies the time limit; see endOf().
    std::optional<TrialEnd> end() const { return end_; }
    bool jammed() const { return jammed_; }
    int jams() const { return jams_; }  ///< number of jams so far
    double milliseconds(Phase phase) const { return ms_[static_cast<std::size_t>(phase)]; }
    double elapsed() const { return elapsed_; }                      ///< ms
    std::optional<double> firstContact() const { return touched_; }  ///< ms
    double depth() const { return depth_; }                          ///< into the hole, mm; negative above it

  private:
    bool updateRest(const TickRecord& tick, double dt);
    Phase phaseOf(const Pose& X_GT) const;
    void updateJam(double force, double dt);

    GoalRegion goal_;
    PhaseLimits limits_;
    Vec3 out_;
    Phase phase_ = Phase::Approach;
    std::optional<TrialEnd> end_;
    std::array<double, kPhaseCount> ms_{};
    double elapsed_ = 0, depth_ = 0;
    std::optional<double> touched_;
    double touchedDepth_ = 0;
    std::optional<Pose> restPose_;  // tool pose at release
    double restMs_ = 0;
    bool jammed_ = false;
    int jams_ = 0;
    double jamDepth_ = 0, jamMs_ = 0;  // greatest depth reached, mm, and time under force since then, ms
};

}  // namespace touchstone::sandbox
