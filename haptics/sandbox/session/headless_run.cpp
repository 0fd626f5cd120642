#include "haptics/sandbox/session/headless_run.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <csignal>
#include <deque>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "haptics/device/control.hpp"
#include "haptics/device/device_table.hpp"
#include "haptics/device/emergency_stop.hpp"
#include "haptics/loop/distances.hpp"
#include "haptics/loop/tick_driver.hpp"
#include "haptics/sandbox/measure/watched_solver.hpp"
#include "haptics/sandbox/record/recorder.hpp"
#include "haptics/sandbox/session/device_choice.hpp"
#include "haptics/threads/tick_period.hpp"

namespace touchstone::sandbox {
namespace {

constexpr double kLongestMotionMs = 86.4e6;  // a day: a longer motion counts as one without an end

/// One pass of the run, tick by tick, until the motion, the recording or the requested time ends.
class Pass {
  public:
    /// `stops`: this pass ends at a signal; false if another pass does.
    Pass(const HapticScene& scene, const Settings& settings, const HeadlessOptions& options, bool stops)
        : stops_(stops) {
        if (const auto folder = recordingOf(options.device)) {
            replay_.emplace(scene, *folder, options.adjust);
            watch(replay_->state(), replay_->settings(), options);
        } else {
            PlacedDevice placed = startPlaced(scene, options.device, settings, options.configFolder, options.say);
            auto session = std::make_unique<Session>(scene.world, placed.settings, std::move(placed.device));
            if (options.paced) session->listWorker = std::make_unique<NeighborListWorker>(*session->world);
            watch(session->state, placed.settings, options);
            driver_.emplace(std::move(session));
            driver_->engage();  // a headless run has no user who engages the forces
        }
        if (geometryOf(this->settings()) == Geometry::Spheres && !world()->hasSpheres())
            throw std::invalid_argument("the scene was opened without the sphere trees that these settings touch");
        const double rate = this->settings().rate;
        if (options.paced) pacer_.emplace(rate, false);
        live_ = options.paced && moverOf(options.device) == Mover::Person;
        const bool endless = driver_ && driver_->session().device->duration().value_or(INFINITY) > kLongestMotionMs;
        if (options.seconds || endless)
            limit_ = std::max(1LL, std::llround(options.seconds.value_or(kUnendingSeconds) * rate));
        toTheEnd_ = !options.seconds;
        if (limit_ > 0) whole_ = static_cast<double>(limit_) / rate;
        if (const std::optional<double> motion = driver_ ? driver_->session().device->duration() : std::nullopt;
            motion && limit_ == 0)
            whole_ = *motion / 1000;
        if (replay_) whole_ = std::min(whole_.value_or(INFINITY), static_cast<double>(replay_->rows()) / rate);
    }

    /// Another pass decides where the run ends at a signal.
    void ignoreSignals() { stops_ = false; }

    /// False when the run is over.
    bool next(TickRecord& record, TickClocks clocks, bool audit) {
        if (stops_ && ticks_ > 0 && StopRequest::signal() != 0) return endWith(RunEnd::Signal);
        if (toTheEnd_ && driver_ && driver_->finished()) return endWith(RunEnd::Motion);
        if (limit_ > 0 && ticks_ == limit_) return endWith(toTheEnd_ ? RunEnd::Limit : RunEnd::Seconds);
        // The force of a late tick is outdated for a hand; a motion that a second pass repeats is not judged by a
        // clock.
        if (live_) clocks.periodMs = period_.begin();
        if (!replay_)
            record = driver_->tick(clocks, audit);
        else if (!replay_->next(record, clocks, audit))
            return endWith(RunEnd::Motion);
        if (live_) record.overruns = pacer_->overruns();
        if (pacer_) pacer_->wait();
        // The clock of the stages also counts while another program has the processor, so a stage could seem longer
        // than its tick.
        for (double* stage : {&record.collisionUs, &record.solveUs, &record.shadowUs})
            *stage = std::min(*stage, record.totalUs);
        ++ticks_;
        return true;
    }

    RunEnd end() const { return end_; }
    /// s of simulated time; nothing if it is not known.
    const std::optional<double>& whole() const { return whole_; }
    const Settings& settings() const { return replay_ ? replay_->settings() : driver_->settings(); }
    const std::shared_ptr<const World>& world() const { return replay_ ? replay_->world() : driver_->session().world; }
    const TickState& state() const { return replay_ ? replay_->state() : driver_->session().state; }
    /// Late ticks; absent if the pass is not paced.
    std::optional<std::uint64_t> overruns() const { return pacer_ ? std::optional(pacer_->overruns()) : std::nullopt; }
    const TickDriver* driver() const { return driver_ ? &*driver_ : nullptr; }
    const ReplayPass* replay() const { return replay_ ? &*replay_ : nullptr; }
    /// The newest tick with its input; `record` is its record.
    RecordedTick recordedTick(const TickRecord& record) const {
        return touchstone::recordedTick(state(), record, replay_ ? replay_->tick().session : 0);
    }

  private:
    static void watch(TickState& state, const Settings& settings, const HeadlessOptions& options) {
        if (options.onSolve) {
            std::unique_ptr<Solver>& solver = renderer(state, settings.solver);
            solver = std::make_unique<WatchedSolver>(std::move(solver), options.onSolve);
        }
        if (options.onFrictionSolve) {
            std::unique_ptr<FrictionSolver>& solver = frictionRenderer(state, settings.frictionSolver);
            solver = std::make_unique<WatchedFrictionSolver>(std::move(solver), options.onFrictionSolve);
        }
    }

    bool endWith(RunEnd end) {
        end_ = end;
        return false;
    }

    bool stops_;
    std::optional<TickDriver> driver_;
    std::optional<ReplayPass> replay_;
    long long limit_ = 0;  // ticks; 0: none
    std::optional<double> whole_;
    bool toTheEnd_ = false;  // runs until the device's motion ends
    long long ticks_ = 0;
    RunEnd end_ = RunEnd::Motion;
    std::optional<Pacer> pacer_;
    bool live_ = false;
    TickPeriod period_;
};

/// The run without audit and shadow, which would otherwise be measured too.
class TimedPass {
  public:
    TimedPass(const HapticScene& scene, const Settings& settings, const HeadlessOptions& options)
        : pass_(scene, unshadowed(settings), unwatched(options), true) {}

    std::optional<TickTimes> next() {
        TickRecord record;
        if (!pass_.next(record, {.stage = stageClock(), .cpuMicroseconds = threadCpuMicroseconds}, false)) return {};
        hash_ = first_ ? hashTick(record) : hashTick(record, hash_);
        first_ = false;
        return TickTimes{record.totalUs, record.collisionUs, record.solveUs, record.listWorkerUs};
    }
    std::uint64_t hash() const { return hash_; }
    RunEnd end() const { return pass_.end(); }
    std::optional<std::uint64_t> overruns() const { return pass_.overruns(); }

  private:
    static Settings unshadowed(Settings settings) {
        settings.shadow = kNoSolver;
        return settings;
    }
    static HeadlessOptions unwatched(HeadlessOptions options) {
        options.adjust = [adjust = options.adjust](const Settings& recorded) {
            return unshadowed(adjust ? adjust(recorded) : recorded);
        };
        options.onSolve = nullptr;
        options.onFrictionSolve = nullptr;
        return options;
    }

    Pass pass_;
    bool first_ = true;
    std::uint64_t hash_ = 0;
};

/// Runs the timed pass slightly ahead of the pass that consumes its times, so that a recording with these times is
/// never far behind. The two passes alternate in stretches, so that only few ticks find cold caches; a paced pass has
/// its own thread.
class TimesAhead {
  public:
    /// `follow`: the times of a paced pass are available while it runs; else only after its end, so that nothing runs
    /// at the same time.
    TimesAhead(TimedPass& pass, bool paced, bool follow) : pass_(pass), follow_(follow) {
        if (paced)
            thread_ = std::jthread([this](const std::stop_token& stop) {
                std::optional<TickTimes> times;
                do {
                    if (!stop.stop_requested()) times = pass_.next();
                    const std::lock_guard lock(mutex_);
                    if (times) ready_.push_back(*times);
                    ended_ = !times || stop.stop_requested();
                    changed_.notify_one();
                } while (!ended_);
            });
    }

    /// Times of the next tick; nothing after the last. Calls `waiting` with the ticks so far while it waits.
    std::optional<TickTimes> next(const std::function<void(std::size_t)>& waiting) {
        if (thread_.joinable()) {
            std::unique_lock lock(mutex_);
            while (!changed_.wait_for(lock, std::chrono::milliseconds(100),
                                      [this] { return ended_ || (follow_ && !ready_.empty()); }))
                waiting(ready_.size());
            return take();
        }
        if (ready_.empty()) runStretch();
        return take();
    }

  private:
    void runStretch() {
        constexpr std::uint64_t kStretch = 50'000'000;  // ns
        const std::uint64_t began = steadyNanoseconds();
        while (steadyNanoseconds() - began < kStretch) {
            const std::optional<TickTimes> times = pass_.next();
            if (!times) return;
            ready_.push_back(*times);
        }
    }
    std::optional<TickTimes> take() {
        if (ready_.empty()) return {};
        const TickTimes times = ready_.front();
        ready_.pop_front();
        return times;
    }

    TimedPass& pass_;
    const bool follow_;
    std::mutex mutex_;  // guards the next two members if there is a thread
    std::deque<TickTimes> ready_;
    bool ended_ = false;
    std::condition_variable changed_;
    std::jthread thread_;  // last member: it uses the others
};

// A tool without contact that is further than this past its goal fell through, mm.
constexpr double kFellThrough = 10;

/// mm that the tool is past the goal along the insertion axis without contact; 0 before or beside the goal.
double fallenPast(const GoalRegion& goal, const TickRecord& tick) {
    if (tick.wrench_C.force.norm() > kContactForce) return 0;
    const Vec3 p = (goal.X_WT.inverse() * tick.X_WT).p;
    const Vec3 out = goal.outAtGoal();
    const double past = -out.dot(p);
    return (p + past * out).norm() < past ? past : 0;
}

/// Takes a tick into HeadlessRun::strongest if it is stronger.
void noteStrongest(std::optional<RunMoment>& strongest, const TickRecord& tick, const Settings& settings,
                   std::uint64_t ticks) {
    if (tick.wrench_C.force.norm() <= kContactForce) return;
    const auto rank = [](const TickRecord& record) {
        return std::pair(record.trips == 0, record.wrench_C.force.norm());
    };
    if (!strongest || rank(tick) > rank(strongest->record)) strongest = RunMoment{tick, settings, ticks};
}

}  // namespace

const char* name(RunEnd end) {
    switch (end) {
        case RunEnd::Motion:
            return "motion";
        case RunEnd::Seconds:
            return "seconds";
        case RunEnd::Limit:
            return "limit";
        case RunEnd::Signal:
            break;
    }
    return StopRequest::signal() == SIGTERM ? "SIGTERM" : StopRequest::signal() == SIGHUP ? "SIGHUP" : "SIGINT";
}

TimedRun timeHeadless(const HapticScene& scene, const Settings& settings, const HeadlessOptions& options) {
    TimedRun run;
    TimedPass pass(scene, settings, options);
    while (const std::optional<TickTimes> times = pass.next()) run.ticks.push_back(*times);
    run.hash = pass.hash();
    run.overruns = pass.overruns();
    return run;
}

HeadlessRun runHeadless(const HapticScene& scene, const Settings& settings, const HeadlessOptions& options) {
    HeadlessRun run;
    std::optional<Recorder> recorder;
    if (!options.record.empty()) recorder.emplace(options.record);
    // No run repeats what a person did, so there is only this one, paced by the clock.
    const bool live = moverOf(options.device) == Mover::Person;
    HeadlessOptions ofPass = options;
    ofPass.paced = live;
    Pass pass(scene, settings, ofPass, true);
    std::optional<TimedPass> timed;
    std::optional<TimesAhead> times;
    if (options.timing && !live) {
        pass.ignoreSignals();
        timed.emplace(scene, settings, options);
        times.emplace(*timed, options.paced, recorder.has_value());
    }

    // What judges and reports the ticks.
    const auto control = pass.driver() ? pass.driver()->session().device->control() : nullptr;
    RunStatistics statistics(scene.roles.gauge);
    // Limits for every tick are checked with any device; limits at the end only with the motion that they belong to.
    const ExpectedOutcome* outcome = outcomeFor(scene, options.device);
    OutcomeJudge judge(outcome ? *outcome : scene.outcome);
    TickClocks clocks;
    if (options.timing) clocks = {.stage = stageClock(), .cpuMicroseconds = threadCpuMicroseconds};
    run.report = reportOf(sceneName(scene), options.device, pass.settings());
    run.report.bySpheres = touchedBySpheres(scene, pass.settings());
    run.report.repairs = repairSentences(scene);
    run.report.toolFile = toolFile(scene);
    std::optional<PenetrationMeter> meter;
    std::uint64_t ticks = 0;
    // A paced pass that ends before this one begins is half of the run.
    const bool halves = times && options.paced && !recorder && pass.whole();
    const auto progress = [&](double pacedTicks, double ticksHere) {
        const double done = halves ? (pacedTicks + ticksHere) / 2 : std::max(pacedTicks, ticksHere);
        if (options.onProgress) options.onProgress(done / pass.settings().rate, pass.whole());
    };
    const auto waiting = [&](std::size_t count) {
        if (!recorder) progress(static_cast<double>(count), 0);
    };
    for (;;) {
        // With timing, the timed pass decides where the run ends.
        const std::optional<TickTimes> us = times ? times->next(waiting) : std::nullopt;
        if ((times && !us) || !pass.next(run.last, clocks, true)) break;
        if (run.world != pass.world()) {
            run.world = pass.world();
            run.strongest.reset();
            meter.emplace(*run.world);
            if (recorder)
                recorder->announce(pass.recordedTick(run.last).session,
                                   pass.replay() ? pass.replay()->scene() : recordedScene(scene.scene.file, *run.world),
                                   options.device);
        }
        run.settings = pass.settings();
        const double penetration = meter->depth(run.last.X_WT, pass.state().obstacles(), geometryOf(run.settings));
        const double dt = 1000 / run.settings.rate;
        statistics.add(run.last, penetration, dt);
        judge.add(run.last, penetration, dt);
        if (scene.roles.goal)
            run.report.pastGoal = std::max(run.report.pastGoal, fallenPast(*scene.roles.goal, run.last));
        if (us) {
            run.last.collisionUs = us->collision;
            run.last.solveUs = us->solve;
            run.last.listWorkerUs = us->listWorker;
            run.last.totalUs = us->step + run.last.shadowUs;
            statistics.addTimes(run.last);
        }
        noteStrongest(run.strongest, run.last, run.settings, ++ticks);
        progress(halves ? *pass.whole() * run.settings.rate : 0, static_cast<double>(ticks));
        if (recorder) recorder->add(pass.recordedTick(run.last), obstaclesAtStart(pass.state()));
        if (options.onTick) options.onTick(run.last, penetration);
        if (options.onRecord) options.onRecord(pass.recordedTick(run.last));
    }
    // The run is over: report it, and check that both passes agree.
    if (recorder) {
        recorder->flush();
        run.recordingFailure = recorder->failure();
    }
    if (run.report.pastGoal < kFellThrough) run.report.pastGoal = 0;
    statistics.write(run.report);
    run.report.ended = name(timed ? timed->end() : pass.end());
    run.report.overruns = timed ? timed->overruns() : pass.overruns();
    if (timed && timed->hash() != run.report.hash)
        throw std::runtime_error(
            "a repeated run gave different results, which is a bug in the program: please report it");

    // Limits at the end are checked only if the demonstration ran to its end.
    run.report.checks = judge.checks(outcome && pass.driver() && pass.driver()->finished());
    if (outcome && pass.driver()) run.report.checksLeft = judge.checks(true).size() - run.report.checks.size();
    if (pass.driver()) {
        const SafetyStage& safety = pass.driver()->session().safety;
        for (const TripCount& trip : safety.counts()) run.report.safetyTrips += trip.events;
        if (safety.engagement() == Engagement::Faulted) run.report.safetyFault = name(safety.cause());
    }
    if (control) run.report.deviceTrouble = troubleOf(control->status());
    if (pass.replay()) run.replay = pass.replay()->check();
    return run;
}

}  // namespace touchstone::sandbox
