#pragma once
// A run without a window: as fast as possible, and bit-reproducible.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "haptics/sandbox/measure/report.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/session/placed_device.hpp"
#include "haptics/sandbox/session/replay_pass.hpp"

namespace touchstone::sandbox {

/// Simulated time after which a headless run ends if neither the device nor the user ends it within a day, s.
inline constexpr double kUnendingSeconds = 60;

/// Why a run ended: at the end of its motion or recording, after the requested seconds, after kUnendingSeconds, or at a
/// signal that StopRequest caught.
enum class RunEnd { Motion, Seconds, Limit, Signal };
/// "motion", "seconds", "limit", or the name of the signal.
const char* name(RunEnd end);

struct HeadlessOptions {
    std::string device = "demo";    ///< NAME or NAME:FILE; replay:FOLDER repeats a recording by step() alone
    std::optional<double> seconds;  ///< simulated time; by default until the device's motion ends, see kUnendingSeconds
    /// Measure CPU times, in a second pass without audit and shadow. A device that a person moves (Mover) has only one
    /// pass, paced by the clock and without CPU times.
    bool timing = true;
    /// The pass that measures times runs in real time, with the list worker, as in a window.
    bool paced = false;
    std::filesystem::path record = {};        ///< folder for a recording of the run; empty: no recording
    std::filesystem::path configFolder = {};  ///< where workspaces of devices are saved; empty: they are the default
    Say say = {};                             ///< receives what is said of the device before the run
    /// Changes the settings of a recording that is replayed.
    std::function<Settings(const Settings&)> adjust = {};
    /// Called while the run lasts, at least ten times a second if ticks are short: how much of it is done, and the
    /// whole if that is known, s of simulated time.
    std::function<void(double done, const std::optional<double>& whole)> onProgress = {};
    /// Called after every tick of the run with its true penetration, mm.
    std::function<void(const TickRecord&, double penetration)> onTick = {};
    /// Likewise with what a recording holds of the tick.
    std::function<void(const RecordedTick&)> onRecord = {};
    /// Called with every problem of the rendering solver and its answer.
    std::function<void(const QpProblem&, const SolveResult&)> onSolve = {};
    /// Likewise with friction.
    std::function<void(const FrictionProblem&, const FrictionResult&)> onFrictionSolve = {};
};

/// A tick of a run.
struct RunMoment {
    TickRecord record;
    Settings settings;        ///< in that tick
    std::uint64_t ticks = 0;  ///< of the run up to it, itself included
};

struct HeadlessRun {
    Report report;
    TickRecord last;                     ///< the last tick
    Settings settings;                   ///< of the last tick
    std::shared_ptr<const World> world;  ///< of the last tick
    /// The tick with the greatest force among those in which the safety stage limited nothing, or among all if it
    /// always limited the force; nothing if no tick felt a force.
    std::optional<RunMoment> strongest;
    std::optional<ReplayCheck> replay;  ///< if it replayed a recording: how the ticks compare
    std::string recordingFailure;       ///< one sentence if an error stopped the recording; else empty
};

/// The times of one tick, thread CPU time in µs.
struct TickTimes {
    double step, collision, solve, listWorker;
};

struct TimedRun {
    std::vector<TickTimes> ticks;
    std::uint64_t hash = 0;                 ///< as in the report
    std::optional<std::uint64_t> overruns;  ///< late ticks; absent if the run is not paced
};

/// Runs the scene from its start. A recording is replayed from its own start and with its own settings instead of
/// `settings`. Without `timing` the report has no times. What is recorded is never more than 0.25 s of wall time behind
/// the run. Pre: the scene has a world, with the trees that the settings touch (else std::invalid_argument), and
/// checkSettings() accepts them. Throws std::runtime_error with one
/// sentence if the device cannot start.
HeadlessRun runHeadless(const HapticScene& scene, const Settings& settings, const HeadlessOptions& options = {});

/// The times of the same run without audit and shadow, which would otherwise be measured too. Neither changes a result,
/// so the hash must equal that of runHeadless(). Preconditions and errors as there.
TimedRun timeHeadless(const HapticScene& scene, const Settings& settings, const HeadlessOptions& options = {});

}  // namespace touchstone::sandbox
