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

/// The run from its start, tick by tick, until the motion, the recording or the asked time ends.
class Pass {
  public:
    Pass(const HapticScene& scene, const Settings& settings, const HeadlessOptions& options) {
        if (const auto folder = recordingOf(options.device)) {
            replay_.emplace(scene, *folder, options.adjust);
            watch(replay_->state(), replay_->settings(), options);
        } else {
            auto session = std::make_unique<Session>(scene.world, settings, startDevice(scene, options.device));
            if (options.paced) session->keeper = std::make_unique<ListKeeper>(*session->world);
            watch(session->state, settings, options);
            driver_.emplace(std::move(session));
            driver_->engage();  // nobody else is there to do it
        }
        const double rate = this->settings().rate;
        if (options.paced) pacer_.emplace(rate, false);
        if (options.seconds) limit_ = std::max(1LL, std::llround(*options.seconds * rate));
    }

    /// False when the run is over.
    bool next(TickRecord& record, const TickClocks& clocks, bool audit) {
        if (limit_ > 0 && ticks_ == limit_) return false;
        if (replay_) {
            if (!replay_->next(record, clocks, audit)) return false;
        } else {
            if (limit_ == 0 && driver_->finished()) return false;
            record = driver_->tick(clocks, audit);
        }
        if (pacer_) pacer_->wait();
        // The stages' clock runs on while another program has the processor; no stage takes longer than its tick.
        for (double* stage : {&record.collisionUs, &record.solveUs, &record.shadowUs})
            *stage = std::min(*stage, record.totalUs);
        ++ticks_;
        return true;
    }

    const Settings& settings() const { return replay_ ? replay_->settings() : driver_->settings(); }
    const std::shared_ptr<const World>& world() const { return replay_ ? replay_->world() : driver_->session().world; }
    const StepState& state() const { return replay_ ? replay_->state() : driver_->session().state; }
    /// By the clock, where one paces.
    std::optional<std::uint64_t> overruns() const { return pacer_ ? std::optional(pacer_->overruns()) : std::nullopt; }
    const TickDriver* driver() const { return driver_ ? &*driver_ : nullptr; }
    const ReplayPass* replay() const { return replay_ ? &*replay_ : nullptr; }
    /// The newest tick whole, `record` being what is known of it.
    WholeTick whole(const TickRecord& record) const {
        return {state().input(), record, replay_ ? replay_->tick().session : 0};
    }

  private:
    static void watch(StepState& state, const Settings& settings, const HeadlessOptions& options) {
        if (!options.onSolve) return;
        std::unique_ptr<Solver>& renderer = state.renderer(settings.solver);
        renderer = std::make_unique<WatchedSolver>(std::move(renderer), options.onSolve);
    }

    std::optional<TickDriver> driver_;
    std::optional<ReplayPass> replay_;
    long long limit_ = 0;  // 0: until the motion ends
    long long ticks_ = 0;
    std::optional<Pacer> pacer_;
};

}  // namespace

TimedRun timeHeadless(const HapticScene& scene, Settings settings, HeadlessOptions options) {
    settings.shadow = -1;
    options.adjust = [adjust = options.adjust](const Settings& recorded) {
        Settings adjusted = adjust ? adjust(recorded) : recorded;
        adjusted.shadow = -1;
        return adjusted;
    };
    options.onSolve = nullptr;
    TimedRun run;
    Pass pass(scene, settings, options);
    TickRecord record;
    while (pass.next(record, {.stage = stageClock(), .cpuMicroseconds = threadCpuMicroseconds}, false)) {
        run.hash = run.ticks.empty() ? hashTick(record) : hashTick(record, run.hash);
        run.ticks.push_back({record.totalUs, record.collisionUs, record.solveUs, record.helperUs});
    }
    run.overruns = pass.overruns();
    return run;
}

HeadlessRun runHeadless(const HapticScene& scene, const Settings& settings, const HeadlessOptions& options) {
    HeadlessRun run;
    std::optional<Recorder> recorder;
    if (!options.record.empty()) recorder.emplace(options.record);
    TimedRun timed;
    if (options.timing) timed = timeHeadless(scene, settings, options);

    RunStatistics statistics(scene.roles.gauge);
    // Limits that hold at all times are judged for any device; what the end shows only for the motion they are of.
    const ExpectedOutcome* outcome = outcomeFor(scene, options.device);
    OutcomeJudge judge(outcome ? *outcome : scene.outcome);
    TickClocks clocks;
    if (options.timing) clocks = {.stage = stageClock(), .cpuMicroseconds = threadCpuMicroseconds};
    HeadlessOptions unpaced = options;
    unpaced.paced = false;
    Pass pass(scene, settings, unpaced);
    run.report = reportOf(sceneName(scene), options.device, pass.settings());
    std::optional<PenetrationMeter> meter;
    for (std::size_t tick = 0; pass.next(run.last, clocks, true); ++tick) {
        if (run.world != pass.world()) {
            run.world = pass.world();
            meter.emplace(*run.world);
            if (recorder)
                recorder->announce(pass.whole(run.last).session,
                                   pass.replay() ? pass.replay()->scene() : recordedScene(scene.scene.file, *run.world),
                                   options.device);
        }
        run.settings = pass.settings();
        const double penetration = meter->depth(run.last.X_WT, pass.state().obstacles()), dt = 1000 / run.settings.rate;
        statistics.add(run.last, penetration, dt);
        judge.add(run.last, penetration, dt);
        if (tick < timed.ticks.size()) {
            run.last.collisionUs = timed.ticks[tick].collision;
            run.last.solveUs = timed.ticks[tick].solve;
            run.last.helperUs = timed.ticks[tick].helper;
            run.last.totalUs = timed.ticks[tick].step + run.last.shadowUs;
            statistics.addTimes(run.last);
        }
        if (recorder) recorder->add(pass.whole(run.last), pass.state().obstaclesAtStart());
        if (options.onTick) options.onTick(run.last, penetration);
    }
    if (recorder) {
        recorder->flush();
        run.recordingFailure = recorder->failure();
    }
    statistics.write(run.report);
    run.report.overruns = timed.overruns;
    if (options.timing && timed.hash != run.report.hash)
        throw std::runtime_error(
            "a repeated run gave other results, which is a fault of the program: please report it");

    // What only the end can show is judged when the demonstration itself got there.
    run.report.checks = judge.checks(outcome && pass.driver() && pass.driver()->finished());
    if (pass.driver()) {
        const SafetyStage& safety = pass.driver()->session().safety;
        for (const TripCount& trip : safety.counts()) run.report.safetyTrips += trip.events;
        if (safety.engagement() == Engagement::Faulted) run.report.safetyFault = name(safety.cause());
    }
    if (pass.replay()) run.replay = pass.replay()->check();
    return run;
}

}  // namespace touchstone::system
