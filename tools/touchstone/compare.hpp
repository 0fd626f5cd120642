#pragma once
// One motion of the device, rendered by one solver after another.
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::app {

/// A mode and, if the mode has one, a solver; or default mode with a friction solver.
struct CompareCase {
    std::string mode, solver;
    std::string friction = {};  ///< empty: that of the scene, which is not compared
    std::string name() const {
        const std::string& compared = friction.empty() ? solver : friction;
        return compared.empty() ? mode : mode + " " + compared;
    }
};
/// Every mode with every solver; penalty mode has none. Throws UsageError for a name that does not exist.
std::vector<CompareCase> casesOf(const std::vector<std::string>& modes, const std::vector<std::string>& solvers);

/// Default mode with every friction solver. Throws UsageError likewise.
std::vector<CompareCase> frictionCasesOf(const std::vector<std::string>& solvers);

/// A motion, and the settings that all cases share.
struct ComparedMotion {
    const sandbox::HapticScene& scene;
    std::string device = "demo";  ///< NAME or NAME:FILE; of replay:FOLDER the recorded input of every tick
    std::optional<double> seconds = {};
    std::optional<std::string> tolerance = {};  ///< as --tolerance
    std::vector<std::string> set = {};          ///< KEY=VALUE, overrides mode and solver
};

struct ComparedRun {
    CompareCase what;
    Settings settings;
    std::vector<TickRecord> ticks;    ///< times are the medians of the timed runs, thread CPU time
    std::vector<double> penetration;  ///< true penetration of each tick, mm
    /// Force error of each tick relative to the exact solver on the same rows, with friction on the same contacts, N:
    /// the largest of its solves; negative without rows, or without an exact answer.
    std::vector<double> forceError;
    std::uint64_t deviceHash = 0;  ///< of the device's poses
    std::uint64_t hash = 0;        ///< of the results, as in a report
};

/// Runs each case once in full and times it `runs` times, the cases in turn. Every case is given the same device poses.
/// Throws std::runtime_error when the device's poses depend on the case, as those of a device that reacts to forces do.
std::vector<ComparedRun> compareMotion(const ComparedMotion& motion, const std::vector<CompareCase>& cases, int runs);

/// The table, one line for each run. The force difference is relative to the run of the exact solver in the same mode,
/// tick by tick; the two runs then have different rows.
std::vector<nlohmann::ordered_json> comparisonRows(const std::vector<ComparedRun>& runs);

/// Writes the table and every tick of every run; the names of the files begin with `prefix`.
void writeComparison(const std::vector<ComparedRun>& runs, const std::filesystem::path& folder,
                     const std::string& prefix = "");

}  // namespace touchstone::app
