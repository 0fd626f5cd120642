#pragma once
// One trial: run without a window, recorded, and reported as a row of the study's table.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/session/placed_device.hpp"
#include "haptics/sandbox/trials/protocol.hpp"

namespace touchstone::sandbox {

/// Accumulates the measures of a trial tick by tick. Contact means a force above kContactForce; RMS values and contact
/// means are over the ticks in contact.
class TrialMeasures {
  public:
    TrialMeasures(const GoalRegion& goal, const PhaseLimits& limits) : phases_(goal, limits) {}
    /// `dt`: length of the tick, ms.
    void add(const TickRecord& tick, double dt);
    const PhaseWatch& phases() const { return phases_; }
    /// Number of times that any trip of the safety stage has started.
    std::uint64_t trips() const { return trips_; }
    /// Adds the measures to the row; column names end with the unit. `end`: how the trial ended.
    void write(nlohmann::ordered_json& row, TrialEnd end) const;

  private:
    PhaseWatch phases_;
    std::optional<TickRecord> before_;
    std::uint64_t ticks_ = 0, contactTicks_ = 0, saturatedTicks_ = 0, inexactTicks_ = 0, lateTicks_ = 0,
                  overrunsBefore_ = 0, trips_ = 0, hash_ = 0;
    double force_ = 0, torque_ = 0, forceSquares_ = 0, torqueSquares_ = 0, impulse_ = 0;
    double path_ = 0, rotation_ = 0, rows_ = 0, cpuUs_ = 0, mostCpuUs_ = 0;
    int mostRows_ = 0;
};

/// Whether a column holds a time measured by a clock, which may differ from run to run.
bool isMeasuredTime(const std::string& column);

/// The device of a trial. The scripted hand `insert` gets the random seed of the trial.
std::string deviceOf(const Condition& condition, const Trial& trial);
/// Whether the device moves without a user, so that it must not be chosen before the trial starts.
bool movesByItself(const std::string& device);
/// How the trial has ended, by its phases or its time limit; nothing while it goes on.
std::optional<TrialEnd> endOf(const PhaseWatch& phases, const Condition& condition);

/// The first columns of a row, which identify the trial.
nlohmann::ordered_json trialColumns(const Protocol& protocol, const Trial& trial);
/// The row of a trial that ended with the tool at X_WT.
nlohmann::ordered_json trialRow(const HapticScene& scene, const Protocol& protocol, const Trial& trial,
                                const Settings& settings, const TrialMeasures& measures, TrialEnd end,
                                const TickRecord& last, const std::filesystem::path& folder);

/// Runs the trial tick by tick in simulated time until it ends or reaches its time limit, and records it into `folder`.
/// The clock paces it if a person moves the device; with any other device the row is reproducible except for the
/// columns of isMeasuredTime(). configFolder, say: as of HeadlessOptions. Returns nothing when
/// StopRequest::signal() requested a stop before the end. Pre: the scene is that of the trial's condition and has a
/// world. Throws std::runtime_error with one sentence when the scene has no goal, the device cannot start or the
/// recording failed.
std::optional<nlohmann::ordered_json> runTrial(const HapticScene& scene, const Protocol& protocol, const Trial& trial,
                                               const std::filesystem::path& folder,
                                               const std::filesystem::path& configFolder = {}, const Say& say = {});

}  // namespace touchstone::sandbox
