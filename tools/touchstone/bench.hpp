#pragma once
// The parts of the benchmark: planning a sweep, measuring it, and showing it. A result is a flat JSON object, which is
// also a line of a CSV table.
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "haptics/loop/settings.hpp"
#include "haptics/qp/solver.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "tools/touchstone/commands.hpp"
#include "tools/touchstone/figures.hpp"

namespace touchstone::app {

using BenchRow = nlohmann::ordered_json;
using QpCost = nlohmann::ordered_json;

struct BenchCommand {
    std::vector<std::string> scenes;  ///< empty: those of the suite
    std::string suite = "sweep", shard;
    std::filesystem::path out;
    bool quick = false, gpu = false;  ///< gpu: also with solvers on other devices than the processor
};

/// One motion of a scene with one choice of settings.
struct BenchCase {
    std::string scene, motion;
    std::vector<std::string> parts = {};  ///< several motions, one after the other, that make up `motion`
    std::string mode = "default", geometry = "spheres", solver{kExactSolver};
    double tolerance = 0;    ///< as of --tolerance; 0: the solver is exact and has none
    int leaves = 0;          ///< of every part; 0: as the scene says
    int linearizations = 0;  ///< 0: as the scene says; paper mode has none
    std::string screening = "none";
    bool listWorker = false;   ///< paced by the clock, with the list worker
    bool fixedMargin = false;  ///< all rows within the margin go to the solver, so that screening has rows to remove
    double rate = 0;           ///< Hz; 0: as the scene says

    /// Identifies the case within a sweep.
    std::string key() const;
    /// The settings of the scene, changed to those of the case and without a shadow.
    Settings settings(const Settings& sceneSettings) const;
    bool needsTrees() const { return mode != "default" || geometry == "spheres"; }
};

/// Everything that a sweep measures, in an order that depends only on the arguments.
struct BenchPlan {
    std::vector<BenchCase> cases;
    std::vector<int> qpRows;  ///< row counts of generated problems for the solvers alone
    std::size_t size() const { return cases.size() + qpRows.size(); }
    /// The k-th of n parts, k from 1: every n-th.
    BenchPlan shard(std::size_t k, std::size_t n) const;
};
/// Throws UsageError for a suite that does not exist, and the exceptions of findScene() and openScene().
BenchPlan planBench(const BenchCommand& command);

/// How much is measured for a row.
struct BenchEffort {
    int runs;           ///< timed runs: their median is reported, of the maxima the smallest
    std::size_t ticks;  ///< of each run, at least; the motion is repeated
    double seconds;     ///< CPU time after which a run begins no further repetition
    std::size_t paced;  ///< like `ticks`, for runs paced by the clock
    int samples;        ///< ticks whose error is split; 0: none, and the scene needs no reference
    double atMost;      ///< CPU time after which a case that has been timed is not timed again, s
};
inline constexpr BenchEffort kQuick{3, 2000, 0.1, 2000, 3, 10}, kFull{5, 50'000, 2, 10'000, 8, 60};

/// Measures cases of one scene with the same leaves; their timed runs are interleaved. `opened` is that scene.
std::vector<BenchRow> measureCases(const sandbox::HapticScene& opened, std::span<const BenchCase> cases,
                                   const BenchEffort& effort);

/// The row counts for which the solvers' cost is measured, and that cost (`touchstone bench qp`).
std::span<const int> qpRowCounts();
std::vector<QpCost> measureQp(int rows, bool quick, bool gpu);

/// The rows of solverTable() that a sweep measures. Throws std::runtime_error with one sentence if this machine cannot
/// use one of them.
std::vector<const SolverInfo*> benchSolvers(bool gpu);
inline constexpr const char* kGpuHelp = "also measure the solver pqp-gpu";

/// A page of HTML with the figures of the folder, which needs no other file.
std::string benchPage(const nlohmann::ordered_json& results, const std::vector<Figure>& figures,
                      const std::filesystem::path& folder);

/// CPU times of `count` equal pieces of work of about this duration, µs: they show how much of the percentiles is due
/// to the machine alone.
std::vector<double> timeConstant(std::size_t count, double us);

/// Adds `touchstone bench qp` below `bench`.
const CLI::App* addBenchQp(CLI::App& bench, Action& action);
/// Likewise `touchstone bench friction`.
const CLI::App* addBenchFriction(CLI::App& bench, Action& action);
/// Likewise `touchstone bench gpu`.
const CLI::App* addBenchGpu(CLI::App& bench, Action& action);

}  // namespace touchstone::app
