#pragma once
// "Sweep this contact": every solver over its tolerances on the rows of one tick, off the loop.
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "haptics/loop/step.hpp"
#include "haptics/qp/row_screen.hpp"

namespace touchstone::sandbox {

struct SweepOptions {
    bool allRows = false;  ///< of every pair within the margin; else those that the tick's own search comes to need
    bool warm = false;     ///< in default mode: solvers start where the device was a tick earlier; else cold
};

/// The largest problem that the exact solver has in a tick.
struct FrozenContact {
    RowSet rows;
    Vec6 stiffness, wanted;
    Vec6 wantedBefore;  ///< where the device was a tick earlier
    SweepOptions options;
    Settings settings;
    double reach = 0;  ///< of the tool, mm: what screening goes by
    std::uint64_t tick = 0;
};

/// Repeats the tick `now`, which came after `before`, with memory of its own: the loop takes no part. Nothing where no
/// row is near. Tens of milliseconds.
std::optional<FrozenContact> freezeContact(const World& world, const Settings& settings, const TickRecord& before,
                                           const TickRecord& now, const SweepOptions& options);

/// One solver at one tolerance.
struct SweepPoint {
    int solver = 0;                          ///< index into solverTable()
    double tolerance = 0;                    ///< as of Settings; 0 where the solver is exact
    double us = 0;                           ///< median of the passes
    double forceError = 0, torqueError = 0;  ///< N, mN·m, against the exact answer, before any projection
    int iterations = 0;
    SolveStatus status = SolveStatus::Solved;
    bool onFront = false;  ///< no other is both faster and less wrong
};

struct Sweep {
    std::uint64_t tick = 0;
    int rows = 0;
    Mode mode = Mode::Default;
    std::vector<SweepPoint> points;  ///< in the order of solverTable(), each from coarse to fine
};

/// Every solver with the limits of the settings. `progress` is told 0 to 1 and cancels with false: then nothing comes
/// back.
std::optional<Sweep> sweepContact(const FrozenContact& contact, const std::function<bool(double)>& progress = {});

/// Time and error of a solver at any tolerance, between its points on logarithmic axes; nothing without points.
std::optional<SweepPoint> pointAt(const Sweep& sweep, int solver, double tolerance);

/// CSV, a point a line. Throws std::runtime_error with one sentence when the file cannot be written.
void writeSweep(const Sweep& sweep, const std::filesystem::path& file);

/// A sweep on a thread of its own. One thread at a time calls it; none of its functions waits, but for the end of one
/// solve where a run is cancelled.
class SweepRun {
  public:
    SweepRun();
    ~SweepRun();

    /// In place of one that runs.
    void start(std::shared_ptr<const World> world, const Settings& settings, const TickRecord& before,
               const TickRecord& now, const SweepOptions& options);
    void cancel();
    /// To be called once a frame: takes over what is ready.
    void poll();

    bool running() const { return job_ != nullptr; }
    double progress() const;
    /// The last one that came to its end; null before.
    const Sweep* result() const { return result_ ? &*result_ : nullptr; }
    /// Why the last run has no result, one sentence; empty if it has.
    const std::string& refusal() const { return refusal_; }
    void forget();

  private:
    struct Job;
    std::unique_ptr<Job> job_;
    std::optional<Sweep> result_;
    std::string refusal_;
};

}  // namespace touchstone::sandbox
