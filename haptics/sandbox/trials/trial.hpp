#pragma once
// One trial: run without a window, recorded, and told as a row of the study's table.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/trials/protocol.hpp"

namespace touchstone::sandbox {

/// Collects what a row tells, tick by tick. Contact is a force above kContactForce; RMS values are over those ticks.
class TrialMeasures {
  public:
    TrialMeasures(const GoalRegion& goal, const PhaseLimits& limits) : phases_(goal, limits) {}
    /// `dt`: length of the tick, ms.
    void add(const TickRecord& tick, double dt);
    const PhaseWatch& phases() const { return phases_; }
    /// Beginnings of all guards of the safety stage.
    std::uint64_t trips() const { return trips_; }
    /// Adds its columns to the row, unit in the name. `end`: how it ended.
    void write(nlohmann::ordered_json& row, TrialEnd end) const;

  private:
    PhaseWatch phases_;
    std::optional<TickRecord> before_;
    std::uint64_t ticks_ = 0, contactTicks_ = 0, saturatedTicks_ = 0, lateTicks_ = 0, overrunsBefore_ = 0, trips_ = 0,
                  hash_ = 0;
    double force_ = 0, torque_ = 0, forceSquares_ = 0, torqueSquares_ = 0, impulse_ = 0;
    double path_ = 0, rotation_ = 0, rows_ = 0, cpuUs_ = 0, mostCpuUs_ = 0;
    int mostRows_ = 0;
};

/// The row's columns that hold what was measured by a clock and may differ from run to run.
bool isMeasuredTime(const std::string& column);

/// The device of a trial: of insert the hand of its seed.
std::string deviceOf(const Condition& condition, const Trial& trial);
/// Such a device is not chosen before the trial starts.
bool movesByItself(const std::string& device);
/// How the trial stands: ended by what was seen, or because the time is over.
std::optional<TrialEnd> endOf(const PhaseWatch& phases, const Condition& condition);

/// The first columns of its row: which trial it is.
nlohmann::ordered_json trialColumns(const Protocol& protocol, const Trial& trial);
/// The row of a trial that has ended with the tool at X_WT.
nlohmann::ordered_json trialRow(const HapticScene& scene, const Protocol& protocol, const Trial& trial,
                                const Settings& settings, const TrialMeasures& measures, TrialEnd end, const Pose& X_WT,
                                const std::filesystem::path& folder);

/// Runs the trial from its start, tick by tick in simulated time, until it ends or its time is over, and records it
/// into `folder`. The row repeats but for isMeasuredTime(); there is none when StopRequest::signal() asked to stop
/// before the end. Pre: the scene is that of the trial's condition and has a world. Throws std::runtime_error with one
/// sentence when the scene has no goal, the device cannot start or the recording had to stop.
std::optional<nlohmann::ordered_json> runTrial(const HapticScene& scene, const Protocol& protocol, const Trial& trial,
                                               const std::filesystem::path& folder);

}  // namespace touchstone::sandbox
