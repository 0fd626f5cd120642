#pragma once
// The benchmark's parts: what is to be measured, measuring it, and showing it. A result is a flat JSON object, which is
// a line of the CSV tables too.
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "haptics/loop/settings.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "tools/touchstone/commands.hpp"

namespace touchstone::app {

using BenchRow = nlohmann::ordered_json;
using QpCost = nlohmann::ordered_json;

/// One motion of a scene under one choice of settings.
struct BenchCase {
    std::string scene, motion;
    std::string mode = "default", solver = "dual-active-set";
    double tolerance = 0;    ///< as of --tolerance; 0: the solver is exact and has none
    int leaves = 0;          ///< of every part; 0: as the scene asks
    int linearisations = 0;  ///< 0: as the scene asks; paper mode has none
    std::string screening = "none";
    bool helper = false;       ///< timed by the clock, with the thread that finds lists ahead
    bool fixedMargin = false;  ///< all rows within the margin go to the solver, for screening to have something to do
    double rate = 0;           ///< Hz; 0: as the scene asks

    /// What tells it from all others of a sweep.
    std::string key() const;
    /// Those that the scene asks for, changed to these and without a shadow.
    Settings settings(const Settings& usual) const;
};

/// The k-th of n parts, from --shard K/N; all of it of an empty text. Throws UsageError for any other.
struct Shard {
    std::size_t k = 1, n = 1;
};
Shard shardOf(const std::string& text);

/// Everything that a sweep measures, in an order that depends on the arguments alone.
struct BenchPlan {
    std::vector<BenchCase> cases;
    std::vector<int> qpRows;  ///< rows of made problems for the solvers alone
    std::size_t size() const { return cases.size() + qpRows.size(); }
    /// The k-th of n parts, k from 1: every n-th.
    BenchPlan shard(std::size_t k, std::size_t n) const;
};
/// Throws UsageError for a suite that does not exist, and what findScene() and openScene() throw.
BenchPlan planBench(const BenchCommand& command);

/// How much is done for a row.
struct BenchEffort {
    int runs;           ///< the median of them is given; of the greatest the smallest
    std::size_t ticks;  ///< of each run at least; the motion is repeated
    double seconds;     ///< of processor time after which a run begins no further repetition
    std::size_t paced;  ///< ticks of a run by the clock, in place of `ticks`
    int samples;        ///< ticks whose error is split
};
inline constexpr BenchEffort kQuick{3, 2000, 0.1, 2000, 3}, kFull{5, 50'000, 2, 10'000, 8};

/// Cases of one scene with the same leaves, their timed runs interleaved. `opened` is that scene.
std::vector<BenchRow> measureCases(const sandbox::HapticScene& opened, std::span<const BenchCase> cases,
                                   const BenchEffort& effort);

/// Rows of which the solvers' cost is measured, and that cost (`touchstone bench qp`).
std::span<const int> qpRowCounts();
std::vector<QpCost> measureQp(int rows, bool quick);

/// Objects of equal keys as a table; null is an empty field.
std::string toCsv(const std::vector<nlohmann::ordered_json>& rows);

/// Draws what the results show as SVG and PNG into the folder; returns name and caption of each plot.
struct BenchPlot {
    std::string name, caption;
};
std::vector<BenchPlot> drawPlots(const nlohmann::ordered_json& results, const std::filesystem::path& folder);
/// Everything on one page that needs nothing else. Pre: drawPlots() drew into the folder.
std::string benchPage(const nlohmann::ordered_json& results, const std::vector<BenchPlot>& plots,
                      const std::filesystem::path& folder);

}  // namespace touchstone::app
