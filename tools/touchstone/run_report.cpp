#include "tools/touchstone/run_report.hpp"

#include <spdlog/spdlog.h>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "haptics/files/output_file.hpp"
#include "haptics/math/statistics.hpp"
#include "haptics/sandbox/session/device_choice.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "tools/touchstone/console.hpp"

namespace touchstone::app {
namespace {

/// Whether a figure of contact would be printed as more than zero.
bool touched(const sandbox::Report& report) {
    return report.force >= 0.005 || report.torque >= 0.05 || report.penetration.max.value_or(0) >= 5e-7;
}

void printPercentiles(const char* what, const Percentiles& values, const char* unit) {
    if (values.p50)
        std::printf("  %-12s %10.2f median %10.2f p99 %10.2f p99.9 %10.2f worst  %s\n", what, *values.p50, *values.p99,
                    *values.p999, *values.max, unit);
}

/// What was touched, how deep, and how long ticks took.
void printSummary(const sandbox::Report& report) {
    if (!touched(report))
        std::printf("  the tool touched nothing");
    else
        std::printf("  force up to %.2f N, torque up to %.1f mN·m, penetration up to %.6f mm", report.force,
                    report.torque, report.penetration.max.value_or(0));
    if (report.stepUs.p50) std::printf("; step %.1f µs median, %.0f worst", *report.stepUs.p50, *report.stepUs.max);
    std::printf("\n");
}

/// Every figure of the ticks.
void printFigures(const sandbox::Report& report) {
    printPercentiles("step", report.stepUs, "µs");
    printPercentiles("collision", report.collisionUs, "µs");
    printPercentiles("solve", report.solveUs, "µs");
    if (report.listWorkerUs.max.value_or(0) > 0) printPercentiles("list worker", report.listWorkerUs, "µs");
    if (report.shadow != "none") {
        printPercentiles("shadow", report.shadowUs, "µs");
        if (const Percentiles& error = report.shadowForceError; error.p50)
            std::printf("  shadow error %10.4f median %10.4f p99 %17s %10.4f worst  N\n", *error.p50, *error.p99, "",
                        *error.max);
    }
    const auto& friction = report.friction;
    if (friction.sticking + friction.sliding + friction.held > 0)
        std::printf(
            "  friction by %s, shadow %s: %llu ticks stick, %llu slide; %llu soft, %llu held, %llu replaced\n"
            "    solved by Newton's steps in %llu ticks, by rounds in %llu, by continuation in %llu\n",
            report.frictionSolver.c_str(), report.frictionShadow.c_str(),
            static_cast<unsigned long long>(friction.sticking), static_cast<unsigned long long>(friction.sliding),
            static_cast<unsigned long long>(friction.soft), static_cast<unsigned long long>(friction.held),
            static_cast<unsigned long long>(friction.replaced), static_cast<unsigned long long>(friction.stages[0]),
            static_cast<unsigned long long>(friction.stages[1]), static_cast<unsigned long long>(friction.stages[2]));
    if (touched(report))
        std::printf(
            "  rows up to %.0f, force up to %.2f N, torque up to %.1f mN·m\n  penetration up to %.6f mm, hover up to "
            "%.4f mm\n",
            report.rows.max.value_or(0), report.force, report.torque, report.penetration.max.value_or(0),
            report.hover.max.value_or(0));
    else
        std::printf("  the tool touched nothing\n");
}

}  // namespace

void printReport(const sandbox::Report& report, bool verbose) {
    std::printf("%s: %s mode, solver %s, shadow %s, %llu ticks at %g Hz\n", engine::escaped(report.scene).c_str(),
                report.mode.c_str(), report.solver.c_str(), report.shadow.c_str(),
                static_cast<unsigned long long>(report.ticks), report.rate);
    if (verbose)
        printFigures(report);
    else
        printSummary(report);
    if (!report.gauge.empty())
        std::printf("  %s: %.3f mm maximum, %.3f mm at the end\n", report.gauge.c_str(), report.depth.deepest,
                    report.depth.last);
    if (verbose)
        std::printf("  %llu ticks left the tool short of its place; %llu took longer than their period\n",
                    static_cast<unsigned long long>(report.unfinished),
                    static_cast<unsigned long long>(report.tooLong));
    if (report.infeasible || report.rowsTruncated || report.safetyTrips)
        std::printf("  %llu ticks with infeasible rows, %lld rows truncated, %llu safety trips\n",
                    static_cast<unsigned long long>(report.infeasible), static_cast<long long>(report.rowsTruncated),
                    static_cast<unsigned long long>(report.safetyTrips));
    if (report.byProcessor)
        std::printf("  %llu ticks that the card left to the processor\n",
                    static_cast<unsigned long long>(report.byProcessor));
    if (report.badInput)
        std::printf("  %llu ticks with an invalid pose, in which the tool was held without force\n",
                    static_cast<unsigned long long>(report.badInput));
    if (report.overlapping)
        std::printf(
            "  %llu ticks in which tool and obstacle overlap, as at the start: the tool passes through what it began "
            "inside, "
            "and feels it once it is out\n",
            static_cast<unsigned long long>(report.overlapping));
    for (const std::string& sentence : report.bySpheres) std::printf("  %s\n", sentence.c_str());
    if (verbose)
        for (const std::string& sentence : report.repairs) std::printf("  %s\n", sentence.c_str());
    if (report.ended == "limit")
        std::printf(
            "  ended after %g s of simulated time, because the device had not ended; --seconds sets another limit\n",
            sandbox::kUnendingSeconds);
    else if (report.ended.starts_with("SIG"))
        std::printf("  stopped by %s after %g s of simulated time\n", report.ended.c_str(),
                    static_cast<double>(report.ticks) / report.rate);
    if (!report.stuck.empty()) std::printf("  %s\n", report.stuck.c_str());
    if (report.pastGoal > 0)
        std::printf("  the tool fell through: it was %.1f mm past its goal without contact\n", report.pastGoal);
    if (!report.safetyFault.empty())
        std::printf("  the safety stage switched the force off: %s\n", report.safetyFault.c_str());
    if (!report.deviceTrouble.empty()) std::printf("  the device, at the end: %s\n", report.deviceTrouble.c_str());
    if (report.overruns)
        std::printf("  %llu ticks ended late, %llu were not recorded\n",
                    static_cast<unsigned long long>(*report.overruns), static_cast<unsigned long long>(report.dropped));
    if (verbose) std::printf("  hash %s\n", toJson(report).at("hash").get<std::string>().c_str());
    if (report.checks.empty() && report.checksLeft == 0) return;
    std::printf("  expected outcome: %s\n", !report.met() ? "NOT MET"
                                            : report.checksLeft > 0 || report.ended.starts_with("SIG")
                                                ? "not judged, since the run stopped before the end "
                                                  "of the demonstration; met so far"
                                                : "met");
    for (const sandbox::OutcomeCheck& check : report.checks)
        if (verbose || !check.met)
            std::printf("    %-5s %-22s limit %-10g was %g\n", check.met ? "ok" : "UNMET", check.name.c_str(),
                        check.limit, check.value);
}

void writeReport(const sandbox::Report& report, const std::filesystem::path& file) {
    writeFile(file, "the report", toJson(report).dump(2) + "\n");
}

/// What the thread needs of a scene, which the window may change while it works.
struct LiveReport::Start {
    sandbox::ExpectedOutcome outcome;
    std::optional<sandbox::Gauge> gauge;
    std::shared_ptr<const World> world;
};

LiveReport::LiveReport(TickTable* table)
    : table_(table), worker_([this](const std::stop_token& stop) { work(stop); }) {}

LiveReport::~LiveReport() = default;

void LiveReport::add(const TickRecord& record, const sandbox::LiveSession& session) {
    const auto& scene = session.scene();
    if (!scene || !scene->world || !session.snapshot()) return;
    const bool begins = !began_ || session.sceneNumber() != scene_ || record.tick <= last_;
    began_ = true;
    scene_ = session.sceneNumber();
    last_ = record.tick;
    const LoopSnapshot& loop = *session.snapshot();
    const Geometry geometry = geometryOf(loop.settings);
    // Default mode measures the penetration of spheres in every tick.
    const bool measured = loop.settings.mode != Mode::Paper && geometry == Geometry::Spheres;
    std::shared_ptr<const Start> start;
    if (begins) start = std::make_shared<const Start>(scene->outcome, scene->roles.gauge, scene->world);
    std::unique_lock lock(mutex_);
    // Ten minutes of ticks, which take about a gigabyte. Beyond that the window waits.
    constexpr std::size_t kMostWaiting = 600'000;
    changed_.wait(lock, [&] { return waiting_.size() < kMostWaiting; });
    waiting_.push_back({record, std::move(start), loop.X_WO, geometry, loop.settings.rate, measured});
    changed_.notify_all();
}

void LiveReport::work(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [&] { return !waiting_.empty(); }) && !stop.stop_requested()) {
        const Tick& tick = waiting_.front();  // stays where it is while others are added behind it
        lock.unlock();
        std::exception_ptr failure;
        try {
            measure(tick);
        } catch (...) {
            failure = std::current_exception();
        }
        lock.lock();
        if (!failure_) failure_ = failure;
        waiting_.pop_front();
        changed_.notify_all();
    }
}

void LiveReport::measure(const Tick& tick) {
    if (tick.start) {
        statistics_ = sandbox::RunStatistics(tick.start->gauge);
        judge_ = std::make_unique<sandbox::OutcomeJudge>(tick.start->outcome);
        world_ = tick.start->world;
        meter_.emplace(*world_);
    }
    const double penetration =
        tick.measured ? tick.record.penetration : meter_->depth(tick.record.X_WT, tick.X_WO, tick.geometry);
    statistics_.add(tick.record, penetration, 1000 / tick.rate);
    statistics_.addTimes(tick.record);
    judge_->add(tick.record, penetration, 1000 / tick.rate);
    if (table_) table_->add(tick.record, penetration, tick.rate);
}

void LiveReport::finishTicks() {
    std::unique_lock lock(mutex_);
    constexpr std::size_t kFew = 2000;  // are measured within a few seconds
    if (waiting_.size() > kFew) spdlog::info("measuring the penetration of the last {} ticks", waiting_.size());
    changed_.wait(lock, [&] { return waiting_.empty(); });
    if (failure_) std::rethrow_exception(failure_);
}

void LiveReport::addFrame(const sandbox::FrameCost& cost) {
    frameMs_.push_back(cost.cpuMs);
    drawCalls_.push_back(cost.drawCalls);
}

sandbox::Report LiveReport::finish(const sandbox::LiveSession& session) const {
    const std::string scene = session.scene() ? sandbox::sceneName(*session.scene()) : "";
    sandbox::Report report = sandbox::reportOf(scene, session.device().choice, session.settings());
    if (session.scene()) {
        report.bySpheres = sandbox::touchedBySpheres(*session.scene(), session.settings());
        report.repairs = sandbox::repairSentences(*session.scene());
        report.toolFile = sandbox::toolFile(*session.scene());
    }
    statistics_.write(report);
    if (const auto& status = session.device().facts.status) report.deviceTrouble = troubleOf(*status);
    report.frameCpuMs = percentiles(frameMs_);
    report.drawCalls = percentiles(drawCalls_);
    if (const LoopSnapshot* snapshot = session.snapshot()) {
        report.overruns = snapshot->overruns;
        report.dropped = snapshot->dropped;
        for (const TripCount& trip : snapshot->trips) report.safetyTrips += trip.events;
        if (snapshot->engagement == Engagement::Faulted) report.safetyFault = name(snapshot->cause);
        if (judge_)
            report.checks =
                judge_->checks(sandbox::followsDemonstration(session.device().choice) && snapshot->finished);
    }
    return report;
}

void WindowLoad::add(const TickRecord& record) {
    if (tickUs_.empty()) overrunsBefore_ = record.overruns;
    overruns_ = record.overruns;
    tickUs_.push_back(record.totalUs);
    stepUs_.push_back(record.totalUs - record.shadowUs);
    periodUs_.push_back(record.periodUs);
}

void WindowLoad::frame(const sandbox::LiveSession& session, const sandbox::FrameCost& cost) {
    const std::uint64_t clock = steadyNanoseconds();
    if (clock_ != 0) {
        cpuMs_.push_back(cost.cpuMs);
        drawingMs_.push_back(cost.drawingMs);
        restMs_.push_back(cost.cpuMs - cost.drawingMs);
        drawCalls_.push_back(cost.drawCalls);
        frameMs_.push_back(1e-6 * static_cast<double>(clock - clock_));
    }
    if (session.running()) {
        clock_ = clock;
        dropped_ = session.snapshot()->dropped;
    }
}

void WindowLoad::print() const {
    std::printf("window: %zu frames, %zu ticks\n", cpuMs_.size(), tickUs_.size());
    printPercentiles("frame", percentiles(cpuMs_), "ms CPU time of the window's thread");
    printPercentiles("drawing", percentiles(drawingMs_), "ms of it, in the renderer and the graphics driver");
    printPercentiles("other", percentiles(restMs_), "ms of it");
    printPercentiles("draw calls", percentiles(drawCalls_), "per frame");
    printPercentiles("frame period", percentiles(frameMs_), "ms");
    printPercentiles("step", percentiles(stepUs_), "µs");
    printPercentiles("with shadow", percentiles(tickUs_), "µs");
    printPercentiles("tick period", percentiles(periodUs_), "µs");
    std::printf("  %llu ticks ended late, %llu were not recorded\n",
                static_cast<unsigned long long>(overruns_ - overrunsBefore_),
                static_cast<unsigned long long>(dropped_));
}

}  // namespace touchstone::app
