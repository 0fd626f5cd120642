#include "haptics/system/headless_run.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include "haptics/loop/rt_thread.hpp"
#include "haptics/loop/tick_driver.hpp"
#include "haptics/system/device_choice.hpp"
#include "haptics/system/watched_solver.hpp"

namespace touchstone::system {
namespace {

/// The run from its start, tick by tick, until the motion or the asked time ends.
class Pass {
  public:
    Pass(const HapticScene& scene, const Settings& settings, const HeadlessOptions& options)
        : driver_(makeSession(scene, settings, options)) {
        driver_.engage();  // nobody else is there to do it
        if (options.paced) pacer_.emplace(settings.rate, false);
        if (options.seconds) limit_ = std::max(1LL, std::llround(*options.seconds * settings.rate));
    }

    /// False when the run is over.
    bool next(TickRecord& record, const TickClocks& clocks, bool audit) {
        if (limit_ > 0 ? ticks_ == limit_ : driver_.finished()) return false;
        record = driver_.tick(clocks, audit);
        if (pacer_) pacer_->wait();
        // The stages' clock runs on while another program has the processor; no stage takes longer than its tick.
        for (double* stage : {&record.collisionUs, &record.solveUs, &record.shadowUs})
            *stage = std::min(*stage, record.totalUs);
        ++ticks_;
        return true;
    }

    const TickDriver& driver() const { return driver_; }

  private:
    static std::unique_ptr<Session> makeSession(const HapticScene& scene, const Settings& settings,
                                                const HeadlessOptions& options) {
        auto session = std::make_unique<Session>(scene.world, settings, startDevice(scene, options.device));
        if (options.paced) session->keeper = std::make_unique<ListKeeper>(*session->world);
        if (options.onSolve) {
            std::unique_ptr<Solver>& renderer = session->state.renderer(settings.solver);
            renderer = std::make_unique<WatchedSolver>(std::move(renderer), options.onSolve);
        }
        return session;
    }

    TickDriver driver_;
    long long limit_ = 0;  // 0: until the motion ends
    long long ticks_ = 0;
    std::optional<Pacer> pacer_;
};

}  // namespace

TimedRun timeHeadless(const HapticScene& scene, Settings settings, HeadlessOptions options) {
    settings.shadow = -1;
    options.onSolve = nullptr;
    TimedRun run;
    Pass pass(scene, settings, options);
    TickRecord record;
    while (pass.next(record, {.stage = stageClock(), .cpuMicroseconds = threadCpuMicroseconds}, false)) {
        run.hash = run.ticks.empty() ? hashTick(record) : hashTick(record, run.hash);
        run.ticks.push_back({record.totalUs, record.collisionUs, record.solveUs, record.helperUs});
    }
    return run;
}

HeadlessRun runHeadless(const HapticScene& scene, const Settings& settings, const HeadlessOptions& options) {
    HeadlessRun run;
    run.report = reportOf(sceneName(scene), options.device, settings);
    TimedRun timed;
    if (options.timing) timed = timeHeadless(scene, settings, options);

    RunStatistics statistics;
    // Limits that hold at all times are judged for any device; what the end shows only for the motion they are of.
    const ExpectedOutcome* outcome = outcomeFor(scene, options.device);
    OutcomeJudge judge(outcome ? *outcome : scene.outcome);
    const double dt = 1000 / settings.rate;
    TickClocks clocks;
    if (options.timing) clocks = {.stage = stageClock(), .cpuMicroseconds = threadCpuMicroseconds};
    HeadlessOptions unpaced = options;
    unpaced.paced = false;
    Pass pass(scene, settings, unpaced);
    PenetrationMeter meter(*scene.world);
    for (std::size_t tick = 0; pass.next(run.last, clocks, true); ++tick) {
        const double penetration = meter.depth(run.last.X_WT);
        statistics.add(run.last, penetration, dt);
        judge.add(run.last, penetration, dt);
        if (tick < timed.ticks.size()) {
            run.last.collisionUs = timed.ticks[tick].collision;
            run.last.solveUs = timed.ticks[tick].solve;
            run.last.helperUs = timed.ticks[tick].helper;
            run.last.totalUs = timed.ticks[tick].step + run.last.shadowUs;
            statistics.addTimes(run.last);
        }
        if (options.onTick) options.onTick(run.last, penetration);
    }
    statistics.write(run.report);
    if (options.timing && timed.hash != run.report.hash)
        throw std::runtime_error(
            "a repeated run gave other results, which is a fault of the program: please report it");

    // What only the end can show is judged when the demonstration itself got there.
    run.report.checks = judge.checks(outcome && pass.driver().finished());
    const SafetyStage& safety = pass.driver().session().safety;
    for (const TripCount& trip : safety.counts()) run.report.safetyTrips += trip.events;
    if (safety.engagement() == Engagement::Faulted) run.report.safetyFault = name(safety.cause());
    return run;
}

}  // namespace touchstone::system
