#pragma once
// One motion of the device, fed to one solver after another.
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "haptics/sandbox/scene/scene_world.hpp"
#include "tools/touchstone/commands.hpp"

namespace touchstone::app {

/// What renders: a mode and, where it has one, a solver.
struct CompareCase {
    std::string mode, solver;
    std::string name() const { return solver.empty() ? mode : mode + " " + solver; }
};
/// Every mode with every solver; penalty has none. Throws UsageError for a name that does not exist.
std::vector<CompareCase> casesOf(const std::vector<std::string>& modes, const std::vector<std::string>& solvers);

/// A motion and what all cases have in common.
struct ComparedMotion {
    const sandbox::HapticScene& scene;
    std::string device = "demo";  ///< NAME or NAME:FILE; of replay:FOLDER the recorded input of every tick
    std::optional<double> seconds = {};
    std::optional<std::string> tolerance = {};  ///< as --tolerance
    std::vector<std::string> set = {};          ///< KEY=VALUE, wins over mode and solver
};

struct ComparedRun {
    CompareCase what;
    Settings settings;
    std::vector<TickRecord> ticks;    ///< times are the medians of the timed runs, thread CPU time
    std::vector<double> penetration;  ///< true, of each tick, mm
    /// Of each tick against the exact solver on the same rows, N, the worst of its linearisations; negative without
    /// rows, or where they contradict each other.
    std::vector<double> forceError;
    std::uint64_t deviceHash = 0;  ///< of the device's poses
    std::uint64_t hash = 0;        ///< of what was done, as a report's
};

/// Judges each case in full once and times it `runs` times, the cases by turns. Every case is given the same poses of
/// the device. Throws std::runtime_error when the device gives others each time, as one that feels the force does.
std::vector<ComparedRun> compareMotion(const ComparedMotion& motion, const std::vector<CompareCase>& cases, int runs);

/// What each run amounts to, a line of the table. Its force difference is from the run of the exact solver in the same
/// mode, tick by tick: rows are then not the same.
std::vector<nlohmann::ordered_json> comparisonRows(const std::vector<ComparedRun>& runs);

/// A value of each tick over time, ms, in at most 800 stretches of which the largest value is kept.
std::vector<std::pair<double, double>> overTime(const ComparedRun& run,
                                                double (*value)(const ComparedRun&, std::size_t));
/// Draws times, rows, force and penetration over time and the mean times into the folder, names beginning with
/// `prefix`.
void drawComparison(const std::vector<ComparedRun>& runs, const std::filesystem::path& folder,
                    const std::string& prefix = "");
/// Writes table, plots and every tick of every run.
void writeComparison(const std::vector<ComparedRun>& runs, const std::filesystem::path& folder,
                     const std::string& prefix = "");

}  // namespace touchstone::app
