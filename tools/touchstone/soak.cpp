// touchstone soak: a long run of the live loop with every change that a user can make, counting what must never happen.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>
#include <stdexcept>
#include <thread>
#include <vector>

#include "haptics/device/emergency_stop.hpp"
#include "haptics/hands/mouse.hpp"
#include "haptics/math/statistics.hpp"
#include "haptics/qp/friction_table.hpp"
#include "haptics/sandbox/session/device_choice.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/sandbox/session/session.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/scene_path.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

struct SoakOptions {
    std::string scene = "bunnies";
    std::string device;  ///< empty: the demonstration, a simulated hand and the mouse in turn
    double seconds = 1800;
    double mostGrowth = 16;  ///< MB
    fs::path record;         ///< folder for recordings; empty: a temporary folder
};

/// Counts values from 0.01 to 1e6 in classes of 1 %: its memory does not grow with the run.
class Histogram {
  public:
    void add(double value) {
        const double step = std::log(std::max(value, kLeast) / kLeast) / kStep;
        ++counts_[std::min(counts_.size() - 1, static_cast<std::size_t>(step))];
        ++total_;
    }
    double percentile(double percent) const {
        std::uint64_t left = static_cast<std::uint64_t>(std::ceil(percent / 100 * static_cast<double>(total_)));
        for (std::size_t i = 0; i < counts_.size(); ++i) {
            if (counts_[i] >= left) return kLeast * std::exp(kStep * (static_cast<double>(i) + 0.5));
            left -= counts_[i];
        }
        return 0;
    }
    std::uint64_t total() const { return total_; }

  private:
    static constexpr double kLeast = 0.01, kStep = 0.01;
    std::array<std::uint64_t, 1850> counts_{};
    std::uint64_t total_ = 0;
};

struct Times {
    Histogram tick, period;  ///< µs
};

/// Resident memory of the process after returning freed memory to the system, MB.
double residentMegabytes() {
    returnFreedMemory();
    std::ifstream in("/proc/self/statm");
    double size = 0, resident = 0;
    in >> size >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

class Soak {
  public:
    explicit Soak(const SoakOptions& options)
        : options_(options),
          folder_(options.record.empty() ? fs::temp_directory_path() / ("touchstone-soak-" + std::to_string(getpid()))
                                         : options.record),
          block_(std::clamp(options.seconds / 16, 1.0, 10.0)),
          session_(sessionOptions()) {}

    int run() {
        const fs::path scene = findScene(options_.scene);
        checkDevice(scene);
        session_.open({.file = scene});
        const auto opening = Clock::now();
        while (!session_.running() && StopRequest::signal() == 0) {
            pass();
            if (!session_.opening() && Seconds(Clock::now() - opening).count() > 5) break;
        }
        if (StopRequest::signal() != 0) return stopped();
        if (!session_.running())
            throw std::runtime_error(session_.log().messages().empty() ? "the scene did not start"
                                                                       : session_.log().messages().back().text);
        began_ = Clock::now();
        // A slow machine records one block as well.
        const auto goesOn = [this] { return seconds() < options_.seconds || recordings_ == 0; };
        for (int block = 0; goesOn() && StopRequest::signal() == 0; ++block) runBlock(block % 2 == 1);
        if (StopRequest::signal() != 0) return stopped();
        return report(scene);
    }

  private:
    sandbox::SessionOptions sessionOptions() {
        sandbox::SessionOptions options;
        options.device = options_.device;
        options.onTick = [this](const TickRecord& record) { judge(record); };
        return options;
    }

    /// A window would fall back to the mouse, and say so.
    void checkDevice(const fs::path& scene) const {
        if (options_.device.empty()) return;
        sandbox::SceneOptions options;
        options.buildWorld = false;
        const sandbox::HapticScene opened = sandbox::openScene(scene, options);
        if (!opened.missing.empty()) throw std::runtime_error(scene.string() + ": " + opened.missing);
        sandbox::startDevice(opened, options_.device, std::make_shared<MouseTarget>());
    }

    double seconds() const { return Seconds(Clock::now() - began_).count(); }
    double random(double from, double to) { return std::uniform_real_distribution(from, to)(random_); }
    int choose(int count) { return std::uniform_int_distribution(0, count - 1)(random_); }

    void judge(const TickRecord& record) {
        ++taken_;
        const DeviceLimits& limits = session_.device().facts.limits;
        constexpr double kRounding = 1 + 1e-12;
        const Wrench& out = record.wrench_out;
        unsafe_ += !out.isFinite() || !(out.force.norm() <= kRounding * limits.peakForce) ||
                   !(out.torque.norm() <= kRounding * limits.peakTorque);
        Times& times = session_.recording().recorder() ? recorded_ : plain_;
        times.tick.add(record.totalUs);
        times.period.add(record.periodUs);
    }

    /// Does what a window does in one frame, without drawing.
    void pass() {
        session_.update();
        for (const sandbox::Message& message : session_.log().messages())
            if (message.kind == sandbox::Message::Kind::Error && message.seconds > reportedUntil_) {
                std::printf("  %.1f s: %s\n", message.seconds, message.text.c_str());
                reportedUntil_ = message.seconds;
            }
        if (const LoopSnapshot* snapshot = session_.snapshot()) {
            // Every tick that was pushed before the snapshot has been received by now.
            const std::uint64_t pushed = snapshot->ticks - snapshot->dropped;
            if (pushed > taken_) uncounted_ = std::max(uncounted_, pushed - taken_);
            dropped_ = snapshot->dropped;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(8));
    }

    void runBlock(bool record) {
        if (record) beginRecording();
        const double end = seconds() + block_;
        const double move = end - random(0.2, 0.8) * block_;
        const bool storm = choose(2) == 0;
        bool moved = false;
        for (double next = 0; seconds() < end && StopRequest::signal() == 0;) {
            pass();
            if (!session_.running() || seconds() < next) continue;
            next = seconds() + (storm ? 0.02 : 0.5);
            changeSettings();
            if (session_.snapshot()->finished) session_.restart();  // the motion again, so that there is contact
            if (!moved && seconds() > move) {
                moved = true;
                changeScene();
            }
        }
        while (session_.opening()) pass();
        if (session_.recording().recorder()) endRecording();
        memory_.push_back({seconds(), residentMegabytes()});
    }

    void changeSettings() {
        ++settings_;
        Settings settings = session_.scene()->settings;
        settings.stiffness = random(0.2, 4);
        settings.torsion = random(200, 4000);
        settings.solver = solverTable()[choose(static_cast<int>(solverTable().size()))].name;
        const int shadow = choose(static_cast<int>(solverTable().size()) + 1);
        settings.shadow = shadow == 0 ? kNoSolver : solverTable()[shadow - 1].name;
        settings.frictionSolver = frictionSolverTable()[choose(static_cast<int>(frictionSolverTable().size()))].name;
        settings.frictionShadow = frictionSolverTable()[choose(static_cast<int>(frictionSolverTable().size()))].name;
        settings.linearizations = 1 + choose(3);
        settings.adaptiveMargin = choose(2) == 0;
        settings.pause = choose(8) == 0;
        session_.setSettings(settings);
    }

    void changeScene() {
        ++scenes_;
        const sandbox::HapticScene& scene = *session_.scene();
        switch (choose(4)) {
            case 0:
                session_.reload();
                break;
            case 1:
                session_.restart();
                break;
            case 2:
                session_.chooseDevice(!options_.device.empty()                                ? options_.device
                                      : scene.demonstration && (followsHand_ = !followsHand_) ? "hand"
                                      : scene.demonstration                                   ? "demo"
                                                                                              : "mouse");
                break;
            default: {
                const engine::Entity obstacle = scene.roles.obstacles.front();
                const auto node = std::find(scene.scene.nodes.begin(), scene.scene.nodes.end(), obstacle);
                const auto& local = scene.scene.registry.get<engine::LocalTransform>(obstacle);
                engine::PlaceNode place{static_cast<int>(node - scene.scene.nodes.begin()), local, local};
                place.to.translation.y -= random(0, 1e-5);
                session_.setEdits({place});
            }
        }
    }

    /// The report of a run that a signal ended too early for a verdict.
    int stopped() {
        std::printf(
            "soak: stopped after %.1f s, %llu ticks, %llu recorded in %s, %llu not counted, %llu unsafe outputs\n",
            seconds(), number(taken_), number(rows_), folder_.c_str(), number(uncounted_), number(unsafe_));
        return kSignalled + StopRequest::signal();
    }

    fs::path recording() const { return folder_ / std::to_string(recordings_); }

    void beginRecording() {
        fs::remove_all(recording());
        ++recordings_;
        session_.record(recording());
    }

    void endRecording() {
        const std::uint64_t rows = session_.recording().recorder()->rows();
        lost_ += session_.recording().recorder()->lost();
        if (!session_.recording().stop()) throw std::runtime_error(session_.log().messages().back().text);
        sandbox::TickFileReader file(recording() / "ticks.npy");
        if (file.rows() != rows) ++broken_;
        rows_ += rows;
    }

    int report(const fs::path& scene) {
        const double warm = std::max(options_.seconds / 4, std::min(40.0, 0.6 * options_.seconds));
        std::vector<double> after;
        for (const auto& [t, megabytes] : memory_)
            if (t >= warm) after.push_back(megabytes);
        if (after.empty())
            after.push_back(memory_.empty() ? 0 : memory_.back().megabytes);  // stopped before it was warm
        const std::size_t few = std::min<std::size_t>(3, after.size());
        const double first = median({after.begin(), after.begin() + static_cast<std::ptrdiff_t>(few)});
        const double last = median({after.end() - static_cast<std::ptrdiff_t>(few), after.end()});

        const std::uint64_t overruns = session_.snapshot()->overruns;
        std::printf("soak: %s, %.0f s, %llu ticks, %llu changes of settings, %llu of scene, device or place\n",
                    scene.stem().c_str(), seconds(), number(taken_), number(settings_), number(scenes_));
        std::printf("  memory      %.1f MB after %.0f s, %.1f MB at the end: grew by %.1f MB, limit %.0f MB\n", first,
                    warm, last, last - first, options_.mostGrowth);
        std::printf("  MB by time, s:");
        for (const auto& [t, megabytes] : memory_) std::printf(" %.0f: %.1f", t, megabytes);
        std::printf("\n  ticks       %llu dropped and counted, %llu not counted, %llu ended late\n", number(dropped_),
                    number(uncounted_), number(overruns));
        std::printf("  recordings  %llu ticks in %llu, %llu lack ticks\n", number(rows_), number(recordings_),
                    number(broken_));
        std::printf("  output      %llu not finite or above the device's limits\n", number(unsafe_));
        for (const auto& [name, times] : {std::pair{"recording off", &plain_}, std::pair{"recording on ", &recorded_}})
            std::printf("  %s  tick p50 %.1f p99 %.1f µs, period p50 %.0f p99 %.0f µs, %llu ticks\n", name,
                        times->tick.percentile(50), times->tick.percentile(99), times->period.percentile(50),
                        times->period.percentile(99), number(times->tick.total()));
        const bool replays = replayLast(scene);
        // Only ticks that were counted as dropped may be missing from a recording.
        const bool good = last - first <= options_.mostGrowth && uncounted_ == 0 && lost_ <= dropped_ && broken_ == 0 &&
                          unsafe_ == 0 && replays && rows_ > 0;
        std::printf("  %s\n", good ? "passed" : "FAILED");
        if (good) {
            std::error_code error;
            fs::remove_all(folder_, error);
        } else {
            std::printf("  the last recording stays in %s\n", recording().c_str());
        }
        return good ? kOk : kFailed;
    }

    bool replayLast(const fs::path& scene) {
        const sandbox::HapticScene opened =
            sandbox::openScene(scene, {.treeCache = sandbox::treeCacheFolder(), .progress = {}, .allTrees = true});
        sandbox::HeadlessOptions options;
        options.device = "replay:" + recording().string();
        options.timing = false;
        const sandbox::ReplayCheck check = *sandbox::runHeadless(opened, opened.settings, options).replay;
        std::printf(
            "  replay      %llu of the last recording's %llu ticks have the recorded bits, %llu after lost ticks\n",
            number(check.same), number(check.ticks), number(check.notCompared));
        return check.same + check.notCompared == check.ticks;
    }

    static unsigned long long number(std::uint64_t n) { return n; }

    const StopRequest stop_;
    const SoakOptions& options_;
    const fs::path folder_;
    const double block_;  // s
    std::mt19937 random_{1};
    Clock::time_point began_ = Clock::now();
    double reportedUntil_ = -1;
    std::uint64_t taken_ = 0, dropped_ = 0, uncounted_ = 0, unsafe_ = 0, lost_ = 0;
    std::uint64_t settings_ = 0, scenes_ = 0, recordings_ = 0, rows_ = 0, broken_ = 0;
    bool followsHand_ = false;  ///< the last device that was chosen is the simulated hand
    struct Memory {
        double t, megabytes;
    };
    std::vector<Memory> memory_;
    Times plain_, recorded_;
    sandbox::LiveSession session_;  // last: its loop ends before the members that it reports to are destroyed
};

int soak(const SoakOptions& options) { return Soak(options).run(); }

constexpr const char* kSoakFooter =
    "Exit code 1 if memory grew by more than --most-growth, a lost tick was not counted, a recording does not replay, "
    "or\n"
    "an output was not finite or above the device's limits.\n\n"
    "Example:\n  touchstone soak bunnies --seconds 60\n";

}  // namespace

void addSoak(CLI::App& program, Action& action) {
    const auto options = std::make_shared<SoakOptions>();
    CLI::App* command = addCommand(
        program, "soak",
        "Run the loop for a long time, recording half of it, while scenes, devices and settings change", kSoakFooter);
    command->add_option("SCENE", options->scene, kSceneHelp)->capture_default_str();
    command->add_option("--device", options->device,
                        "the device that moves the tool, as for `touchstone run`; one with motors is never engaged "
                        "(default: the demonstration, a simulated hand or the mouse, in turn)");
    command->add_option("--seconds", options->seconds, "duration")->check(within(4, 1e6, "s"))->capture_default_str();
    command->add_option("--most-growth", options->mostGrowth, "maximum growth of memory after the first quarter, MB")
        ->check(within(0, 1e6, "MB"))
        ->capture_default_str();
    command->add_option("--record", options->record, "folder for recordings, each removed after it is checked");
    command->callback([options, &action] { action = [options] { return soak(*options); }; });
}

}  // namespace touchstone::app
