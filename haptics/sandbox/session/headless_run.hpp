#pragma once
// A run without thread, clock or window: as fast as it goes, and to the same bits every time.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "haptics/sandbox/measure/report.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/session/replay_pass.hpp"

namespace touchstone::sandbox {

/// How long a headless run lasts in simulated time where neither the device nor the user says that it ends within a
/// day, s.
inline constexpr double kUnendingSeconds = 60;

/// Why a run ended: its motion or recording was over, so were the seconds asked for or kUnendingSeconds, or a signal
/// that StopRequest noted.
enum class RunEnd { Motion, Seconds, Limit, Signal };
/// "motion", "seconds", "limit", or the name of the signal.
const char* name(RunEnd end);

struct HeadlessOptions {
    std::string device = "demo";    ///< NAME or NAME:FILE; replay:FOLDER repeats a recording by step() alone
    std::optional<double> seconds;  ///< simulated; else until the device's motion ends, see kUnendingSeconds
    bool timing = true;             ///< measure CPU times, in a second pass alongside that neither audits nor shadows
    /// Times are taken by the clock, a tick at its time, with the thread beside that finds lists ahead, as in a window.
    bool paced = false;
    std::filesystem::path record = {};  ///< folder for a recording of the run; empty: none
    /// From the settings of a recording that is replayed to those to use.
    std::function<Settings(const Settings&)> adjust = {};
    /// Sees every tick of the run with its true penetration, mm.
    std::function<void(const TickRecord&, double penetration)> onTick = {};
    /// Sees every problem that the rendering solver was given, and its answer.
    std::function<void(const QpProblem&, const SolveResult&)> onSolve = {};
};

struct HeadlessRun {
    Report report;
    TickRecord last;                     ///< the tick at the end
    Settings settings;                   ///< of that
    std::shared_ptr<const World> world;  ///< likewise
    std::optional<ReplayCheck> replay;   ///< of a recording, how it compares
    std::string recordingFailure;        ///< one sentence when the recording had to stop; else empty
};

/// Stage times of a tick by themselves, thread CPU time in µs.
struct TickTimes {
    double step, collision, solve, helper;
};

struct TimedRun {
    std::vector<TickTimes> ticks;
    std::uint64_t hash = 0;                 ///< as the report's
    std::optional<std::uint64_t> overruns;  ///< by the clock, where one paces
};

/// Runs the scene from its start; a recording from its own, with its settings, which are taken in place of `settings`.
/// Without `timing` the report has no times. A recording is never more than 0.25 s of wall time behind the run. Pre:
/// the scene has a world and settings that checkSettings() is content with. Throws std::runtime_error with one sentence
/// when the device cannot start.
HeadlessRun runHeadless(const HapticScene& scene, const Settings& settings, const HeadlessOptions& options = {});

/// The times of the same run, without audit and shadow, whose work inside the tick would be measured too. Neither
/// changes a result, so the hash must be that of runHeadless(). Pre and errors as there.
TimedRun timeHeadless(const HapticScene& scene, const Settings& settings, const HeadlessOptions& options = {});

}  // namespace touchstone::sandbox
