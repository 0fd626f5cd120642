// touchstone run: opens a scene in a window, or steps it headless and reports.
#include <spdlog/spdlog.h>

#include <cstdio>
#include <iterator>
#include <limits>
#include <map>
#include <memory>

#include "engine/scene/folders.hpp"
#include "engine/scene/step_file.hpp"
#include "engine/ui/user_files.hpp"
#include "engine/view/image_file.hpp"
#include "haptics/device/device_table.hpp"
#include "haptics/device/emergency_stop.hpp"
#include "haptics/files/output_file.hpp"
#include "haptics/hands/mouse.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/loop/work_limits.hpp"
#include "haptics/sandbox/app/app_window.hpp"
#include "haptics/sandbox/devices/all_devices.hpp"
#include "haptics/sandbox/measure/contact_sweep.hpp"
#include "haptics/sandbox/measure/fit_check.hpp"
#include "haptics/sandbox/picture/scene_view.hpp"
#include "haptics/sandbox/record/recording.hpp"
#include "haptics/sandbox/session/device_choice.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/qp_file.hpp"
#include "tools/touchstone/run_report.hpp"
#include "tools/touchstone/scene_path.hpp"
#include "tools/touchstone/settings_choice.hpp"
#include "tools/touchstone/tree_parts.hpp"

namespace touchstone::app {
namespace {

constexpr const char* kFirstScene = "bunnies";

struct RunOptions {
    std::string scene;  ///< empty: the recorded scene of a replay, else kFirstScene
    bool headless = false;
    bool paced = false;
    bool verbose = false;
    std::optional<double> seconds;
    std::string device;  ///< empty: defaultDevice()
    SettingsChoice settings;
    std::filesystem::path report, ticks, screenshot, pictures, dumpQp, sweep, record;  ///< empty: none
    std::string show, view;  ///< of the picture: applyShowList(), checkView()
    std::string plots;       ///< the plots shown when a window opens: time, contact, friction or trade
    std::optional<float> uiScale;
    std::string select;  ///< name of the node that is selected in the window at the start
};

/// The display options of the picture or the window.
sandbox::DisplayOptions chosenDisplay(const RunOptions& options) {
    sandbox::DisplayOptions display;
    if (const std::string wrong = sandbox::applyShowList(display, options.show); !wrong.empty())
        throw UsageError("--show: " + wrong);
    if (const std::string wrong = sandbox::checkView(options.view); !wrong.empty())
        throw UsageError("--view: " + wrong);
    return display;
}

std::unique_ptr<TickTable> tableFor(const RunOptions& options) {
    return options.ticks.empty() ? nullptr : std::make_unique<TickTable>(options.ticks);
}

/// Outputs that fail independently: each is written if it can be, and the failures are reported at the end.
class Outputs {
  public:
    /// True while no output of this name has failed.
    bool good(const std::string& name) const { return failures_.count(name) == 0; }
    template <class Work>
    void write(const std::string& name, Work&& work) {
        try {
            work();
        } catch (const std::exception& error) {
            failures_.emplace(name, error.what());
        }
    }
    /// Throws std::runtime_error with the first failure; prints the others.
    void finish() const {
        for (auto failure = failures_.begin(); failure != failures_.end(); ++failure) {
            if (std::next(failure) == failures_.end()) throw std::runtime_error(failure->second);
            spdlog::error("{}", failure->second);
        }
    }

  private:
    std::map<std::string, std::string> failures_;
};
constexpr const char *kTicks = "ticks", *kProblems = "problems";

/// Throws UsageError when two outputs have the same path, or an output would replace the scene.
void checkOutputs(const RunOptions& options, const std::filesystem::path& scene) {
    std::error_code error;
    const auto place = [&](const std::filesystem::path& path) {
        return std::filesystem::weakly_canonical(std::filesystem::absolute(path, error), error);
    };
    std::map<std::filesystem::path, std::string> taken{{place(scene), "the scene"}};
    for (const auto& [path, option] :
         {std::pair{options.report, "--report"}, std::pair{options.ticks, "--ticks"},
          std::pair{options.dumpQp, "--dump-qp"}, std::pair{options.sweep, "--sweep"},
          std::pair{options.screenshot, "--screenshot"}, std::pair{options.record, "--record"}}) {
        const bool special = std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error) &&
                             !std::filesystem::is_directory(path, error);
        if (path.empty() || special) continue;
        const auto [other, isNew] = taken.emplace(place(path), option);
        if (!isNew)
            throw UsageError(std::string(option) + " '" + path.string() + "' is also " + other->second +
                             ": give each a different file");
    }
}

/// Whether a user may still choose roles in the window before anything runs.
bool waitsForUser(const RunOptions& options) { return !options.headless && !options.seconds; }

/// The scene without its trees, which take time to build: enough to find errors in the scene, the settings and the
/// device.
sandbox::HapticScene checkedScene(const std::filesystem::path& file, const RunOptions& options,
                                  std::shared_ptr<MouseTarget> mouse) {
    sandbox::SceneOptions sceneOptions;
    sceneOptions.buildWorld = false;
    sandbox::HapticScene scene = sandbox::openScene(file, sceneOptions);
    if (!waitsForUser(options) && !scene.missing.empty())
        throw std::runtime_error(file.string() + ": " + scene.missing);
    checkedWithCommandLine(scene.settings, options.settings);
    if (const auto recording = sandbox::recordingOf(options.device))
        sandbox::Recording whole(*recording);
    else if (scene.missing.empty() && !options.device.empty())
        sandbox::startDevice(scene, options.device, std::move(mouse));
    if (!options.record.empty() && sandbox::isRecording(options.record))
        throw std::runtime_error("'" + options.record.string() + "' holds a recording already: choose another folder");
    return scene;
}

sandbox::HapticScene openForRun(const std::filesystem::path& file, const RunOptions& options) {
    sandbox::HapticScene scene = checkedScene(file, options, nullptr);
    for (const auto& [path, what] :
         {std::pair{options.report, "the report"}, std::pair{options.screenshot, "the picture"},
          std::pair{options.dumpQp, "the problems"}, std::pair{options.sweep, "the sweep"}})
        if (!path.empty()) requireWritable(path, what);

    sandbox::SceneOptions sceneOptions{.treeCache = sandbox::treeCacheFolder(), .progress = progressBar()};
    const auto recording = sandbox::recordingOf(options.device);
    std::optional<sandbox::Recording> replayed;
    if (recording) replayed.emplace(*recording);
    sceneOptions.allTrees = (replayed && hadSpheres(replayed->scene())) || chosenDisplay(options).trees();
    sceneOptions.adjust = [&](const Settings& ofScene) {
        return checkedWithCommandLine(replayed ? replayed->settings() : ofScene, options.settings);
    };
    scene = sandbox::openScene(std::move(scene.scene), sceneOptions);
    for (const std::string& warning : scene.warnings) spdlog::warn("{}", warning);
    return scene;
}

/// Prints how much of a recording was reproduced. False when the bits should be the recorded ones and are not.
bool reportReplay(const sandbox::ReplayCheck& check) {
    for (const std::string& difference : check.differences) spdlog::warn("replay: {}", difference);
    if (check.notCompared > 0)
        spdlog::warn("replay: the recording lacks ticks; the {} ticks after the gap cannot be reproduced",
                     check.notCompared);
    const std::uint64_t compared = check.ticks - check.notCompared;
    if (!check.different) {
        std::printf("  replay: all of %llu ticks have the recorded bits\n", static_cast<unsigned long long>(compared));
        return true;
    }
    std::printf("  replay: %llu of %llu ticks have the recorded bits; row %llu is the first that differs\n",
                static_cast<unsigned long long>(check.same), static_cast<unsigned long long>(compared),
                static_cast<unsigned long long>(*check.different));
    return !check.differences.empty();
}

int runHeadless(const RunOptions& options, const std::filesystem::path& file) {
    const std::unique_ptr<TickTable> table = tableFor(options);
    sandbox::HeadlessOptions headless;
    headless.seconds = options.seconds;
    headless.paced = options.paced;
    headless.record = options.record;
    headless.configFolder = engine::configFolder();
    headless.say = sayOnConsole;
    headless.adjust = [&](const Settings& recorded) { return checkedWithCommandLine(recorded, options.settings); };
    if (options.paced && sandbox::recordingOf(options.device))
        throw UsageError(
            "--paced measures a device that is paced by the clock, but a recording is replayed as fast as possible: "
            "leave out --paced");
    const sandbox::HapticScene scene = openForRun(file, options);
    headless.device = options.device.empty() ? sandbox::defaultDevice(scene, false) : options.device;
    Settings settings = checkedWithCommandLine(scene.settings, options.settings);
    WorkShares shares;
    if (!options.paced && sandbox::moverOf(headless.device) != Mover::Person)
        shares.shadow = std::numeric_limits<double>::infinity();  // no deadline
    for (const std::string& sentence : keepRoundTripsInTick(settings, shares)) spdlog::warn("{}", sentence);
    sandbox::ScenePicture picture{.display = chosenDisplay(options), .view = options.view};
    std::vector<TickRecord> ticks;  // for the trace
    const bool traced = picture.display.trace && !(options.screenshot.empty() && options.pictures.empty());
    std::optional<sandbox::RunMoment> first;
    sandbox::TickHistory last(2);
    Outputs outputs;
    headless.onTick = [&](const TickRecord& record, double penetration) {
        last.push(record);
        if (!first) first = {record, settings, 1};
        if (table && outputs.good(kTicks))
            outputs.write(kTicks, [&] { table->add(record, penetration, settings.rate); });
        if (traced) ticks.push_back(record);
    };
    std::optional<OutputFile> problems;
    if (!options.dumpQp.empty()) {
        problems.emplace(options.dumpQp, "the problems");
        headless.onSolve = [&](const QpProblem& problem, const SolveResult& result) {
            if (outputs.good(kProblems))
                outputs.write(kProblems, [&] { problems->write(toLine(problem, result) + '\n'); });
        };
    }
    const StopRequest stop;
    headless.onProgress = runProgress();
    sandbox::HeadlessRun run = sandbox::runHeadless(scene, settings, headless);
    headless.onProgress = nullptr;  // clears its line
    run.report.stuck = sandbox::stuckSentence(scene, run.last, run.settings);
    printReport(run.report, options.verbose);
    if (problems && outputs.good(kProblems)) outputs.write(kProblems, [&] { problems->close(); });
    if (table && outputs.good(kTicks)) outputs.write(kTicks, [&] { table->close(); });
    if (!options.report.empty()) outputs.write("report", [&] { writeReport(run.report, options.report); });
    if (!options.sweep.empty())
        outputs.write("sweep", [&] {
            std::optional<sandbox::FrozenContact> contact;
            if (last.newest())
                contact = sandbox::freezeContact(*run.world, run.settings, *last.before(), *last.newest(), {});
            if (!contact)
                throw std::runtime_error(
                    "there is nothing to sweep: nothing is near the tool in the last tick; choose another time with "
                    "--seconds");
            writeSweep(*sandbox::sweepContact(*contact), options.sweep);
        });
    const auto draw = [&](const sandbox::RunMoment& shown, const std::filesystem::path& target) {
        if (traced) picture.before = std::span(ticks).first(shown.ticks);
        engine::writePng(target, sandbox::renderScene(scene, shown.record, shown.settings, picture));
    };
    const sandbox::RunMoment end{run.last, run.settings, run.report.ticks};
    if (!options.screenshot.empty())
        outputs.write("picture", [&] {
            // A requested time is the time to show; otherwise the last tick is often long after the contact.
            const bool ofLast = options.seconds || !run.strongest;
            const sandbox::RunMoment& shown = ofLast ? end : *run.strongest;
            draw(shown, options.screenshot);
            std::printf("  picture at %.3f s, %s: %s\n", static_cast<double>(shown.ticks - 1) / shown.settings.rate,
                        options.seconds ? "the last tick"
                        : ofLast        ? "the last tick, since the tool touched nothing"
                                        : "where the force is largest",
                        options.screenshot.c_str());
        });
    if (!options.pictures.empty() && first)
        outputs.write("pictures", [&] {
            makeFolder(options.pictures, "the pictures");
            draw(*first, options.pictures / "1-before.png");
            if (run.strongest) draw(*run.strongest, options.pictures / "2-contact.png");
            draw(end, options.pictures / "3-end.png");
            std::printf("  pictures of the start%s and the end: %s\n", run.strongest ? ", the largest force" : "",
                        options.pictures.c_str());
        });
    if (!run.recordingFailure.empty())
        outputs.write("recording", [&] { throw std::runtime_error(run.recordingFailure); });
    const bool replayed = !run.replay || reportReplay(*run.replay);
    outputs.finish();
    if (StopRequest::signal() != 0) return kSignalled + StopRequest::signal();
    if (!replayed) return kFailed;
    return run.report.met() ? kOk : kOutcomeUnmet;
}

std::optional<sandbox::PlotsTab> tabOf(const std::string& name) {
    if (name.empty()) return std::nullopt;
    return name == "time"       ? sandbox::PlotsTab::Time
           : name == "contact"  ? sandbox::PlotsTab::Contact
           : name == "friction" ? sandbox::PlotsTab::Friction
                                : sandbox::PlotsTab::Trade;
}

int runInWindow(const RunOptions& options, const std::filesystem::path& file) {
    // The window itself reads a STEP file, and shows how far it is.
    const sandbox::HapticScene scene = engine::isStepFile(file)
                                           ? sandbox::HapticScene()
                                           : checkedScene(file, options, std::make_shared<MouseTarget>());
    const std::unique_ptr<TickTable> table = tableFor(options);
    LiveReport live(table.get());
    sandbox::LiveSession* session = nullptr;  // set in the first frame

    sandbox::WindowRunOptions window;
    window.scene = file;
    window.sceneFolders = {sceneFolder()};
    window.configFolder = engine::configFolder();
    window.session.device = options.device;
    window.session.record = options.record;
    window.recordings = engine::userFolder("TOUCHSTONE_RECORDINGS", "XDG_DATA_HOME", ".local/share");
    window.session.adjust = [&](const Settings& settings) {
        return checkedWithCommandLine(settings, options.settings);
    };
    window.seconds = options.seconds;
    window.screenshot = options.screenshot;
    window.display = chosenDisplay(options);
    window.view = options.view;
    window.window.uiScale = options.uiScale;
    if (!options.select.empty())
        window.select =
            static_cast<std::size_t>(engine::nodeIndex(scene.scene, nodeNamed(scene.scene, options.select)));
    const bool reported = table || !options.report.empty();
    WindowLoad load;
    std::optional<std::uint64_t> began;  // ns
    bool swept = options.sweep.empty(), sweeping = false, written = false;
    window.onFrame = [&](sandbox::WindowFrame& frame) {
        session = &frame.session;
        if (frame.number > 0) {
            load.frame(frame.session, frame.cost);
            live.addFrame(frame.cost);
        }
        if (frame.number == 0) frame.measure.panel.bring = tabOf(options.plots);
        if (!began && session->running()) began = steadyNanoseconds();
        if (!swept && began && 1e-9 * static_cast<double>(steadyNanoseconds() - *began) > 0.6 * *options.seconds) {
            swept = true;
            frame.measure.sweep(*session);
        }
        sweeping = frame.measure.sweeps().running();
        if (const sandbox::Sweep* sweep = frame.measure.sweeps().result();
            sweep && !written && !options.sweep.empty()) {
            written = true;
            sandbox::writeSweep(*sweep, options.sweep);
        }
    };
    window.session.onTick = [&](const TickRecord& record) {
        load.add(record);
        if (session && reported) live.add(record, *session);
    };
    Outputs outputs;
    window.onEnd = [&](sandbox::LiveSession& ended) {
        if (reported) outputs.write(table ? kTicks : "report", [&] { live.finishTicks(); });
        if (!options.report.empty()) outputs.write("report", [&] { writeReport(live.finish(ended), options.report); });
        // A recording that stopped earlier on a failure is reported here too; its reason is also in the log.
        ended.recording().stop();
        if (!ended.recording().failure().empty())
            outputs.write("recording", [&] { throw std::runtime_error(ended.recording().failure()); });
    };
    const StopRequest stop;
    const int code = sandbox::runWindow(window);
    if (table) outputs.write(kTicks, [&] { table->close(); });
    if (!options.sweep.empty() && !written && StopRequest::signal() == 0)
        outputs.write("sweep", [&] {
            throw std::runtime_error(
                sweeping ? "the sweep was not ready when the window closed: give more --seconds"
                         : "there was nothing to sweep at three fifths of --seconds: nothing was near the tool");
        });
    if (options.seconds || StopRequest::signal() != 0) load.print();
    outputs.finish();
    return StopRequest::signal() != 0 ? kSignalled + StopRequest::signal() : code;
}

int runScene(const RunOptions& options) {
    withCommandLine({}, options.settings);  // reports wrong names before a scene is read
    chosenDisplay(options);
    const auto recording = sandbox::recordingOf(options.device);
    const std::filesystem::path file =
        !options.scene.empty() ? findScene(options.scene)
        : recording            ? sceneOfRecording(*recording, {}, "put it beside the recording, or give it as SCENE")
                               : findScene(kFirstScene);
    checkOutputs(options, file);
    if (engine::isStepFile(file) && !waitsForUser(options))
        throw std::runtime_error(
            file.string() +
            ": a STEP file names no tool and no obstacle: make a scene with touchstone new, whose --tool and "
            "--obstacle take files or the parts of one, and run that");
    if (options.headless && !options.select.empty()) throw UsageError("--select needs a window: leave out --headless");
    if (options.headless && options.uiScale) throw UsageError("--ui-scale needs a window: leave out --headless");
    if (options.headless) return runHeadless(options, file);
    if (!options.pictures.empty()) throw UsageError("--pictures needs a headless run: add --headless");
    if (options.verbose) throw UsageError("--verbose needs a headless run: add --headless");
    if (options.paced) throw UsageError("--paced needs a headless run: add --headless");
    if (!options.dumpQp.empty()) throw UsageError("--dump-qp needs a headless run: add --headless");
    if (!options.sweep.empty() && !options.seconds)
        throw UsageError("--sweep in a window needs --seconds: it takes the tick at three fifths of that time");
    requireDisplay();
    return runInWindow(options, file);
}

/// Prints the keys of --set, one per line, and the solvers.
void printSettings() {
    const Settings defaults;
    std::printf("Settings for --set KEY=VALUE and for extras.touchstone.settings of a scene:\n\n");
    for (const SettingInfo& info : settingTable()) {
        std::string value = getSetting(defaults, info.key);
        if (!info.unit.empty()) value += " " + std::string(info.unit);
        std::printf("  %-20s %-18s %s", std::string(info.key).c_str(), value.c_str(), std::string(info.help).c_str());
        if (info.max > info.min) std::printf(" (%g to %g)", info.min, info.max);
        std::printf("\n");
    }
    std::printf("\nSolvers:\n\n");
    for (const SolverInfo& solver : solverTable())
        std::printf("  %-16s %s\n", std::string(solver.name).c_str(), std::string(solver.summary).c_str());
}

constexpr const char* kRunFooter =
    "Settings come from the defaults, then the scene, then --mode, --solver and the like, then --set. Every key of\n"
    "--help-settings is also an option: --stiffness 2 is --set stiffness=2.\n\n"
    "Examples:\n"
    "  touchstone run bunnies\n"
    "  touchstone run spline --headless --report spline.json\n"
    "  touchstone run spline --headless --screenshot in.png --show section,clearance --view contact\n"
    "  touchstone run bunnies --mode paper --headless --seconds 2 --ticks paper.csv\n"
    "  touchstone run part.glb --device replay:hand.csv --shadow none --set stiffness=0.5\n"
    "  touchstone run bunnies --record push\n"
    "  touchstone run --headless --device replay:push\n";

/// "the published method, with solver NAME at TOLERANCE", from the settings that paper mode sets.
std::string paperModeHelp() {
    const Settings paper = sandbox::withMode({}, Mode::Paper);
    return "the published method, with solver " + std::string(findSolver(paper.solver)->name) + " at " +
           getSetting(paper, "tolerance") + " and no shadow unless chosen";
}

}  // namespace

void addRun(CLI::App& program, Action& action) {
    const auto options = std::make_shared<RunOptions>();
    SettingsChoice& settings = options->settings;
    CLI::App* run = addCommand(program, "run", "Run a scene: in a window, or headless with a report", kRunFooter);
    run->add_option(
        "SCENE", options->scene,
        kSceneHelp + std::string(" (default: ") + kFirstScene + ", or the scene of the recording that is replayed)");
    run->add_flag("--headless", options->headless,
                  "without a window, as fast as possible, in simulated time; bit-reproducible");
    run->add_flag("--paced", options->paced,
                  "headless: pace the ticks by the clock and run the list worker, as a window does");
    run->add_option("--seconds", options->seconds,
                    "duration; headless in simulated time (default: headless, until the motion ends, or 60 s if the "
                    "device does not end within a day)")
        ->check(durationInSeconds());
    run->add_option("--device", options->device,
                    "the device that moves the tool, NAME or NAME:FILE: " + namesOf(sandbox::allDevices()) +
                        " (default: demo; without a demonstration, in a window mouse, and headless rest)");
    run->add_option("--mode", settings.mode,
                    "default; paper: " + paperModeHelp() +
                        "; penalty: springs against overlaps, for comparison; or god-object: constrained by the pairs "
                        "that touch, for comparison");
    run->add_option("--geometry", settings.geometry,
                    "what touches in default mode. mesh: the triangles of the parts (default); "
                    "spheres: their sphere trees");
    run->add_option("--solver", settings.solver, "solver that moves the tool: " + namesOf(solverTable()));
    run->add_option("--shadow", settings.shadow, "second solver, measured on the same rows: one of these, or none");
    run->add_option("--tolerance", settings.tolerance, kToleranceHelp);
    run->add_option("--rate", settings.rate, "ticks per second");
    addSet(*run, settings.set, "KEY=VALUE: set one setting by name, as --KEY VALUE does; overrides every other option");
    run->add_flag(
        "--verbose", options->verbose,
        "headless: print all measurements, not a summary: times of each stage, friction, repairs, checks, the hash "
        "of the results");
    run->add_option("--report", options->report, "write the measurements to a JSON file");
    run->add_option("--ticks", options->ticks, "write every tick to a CSV file");
    run->add_option("--record", options->record,
                    "record every tick in a folder that --device replay:FOLDER replays and NumPy reads");
    run->add_option("--dump-qp", options->dumpQp, "headless: write every solved problem, for `touchstone qp`");
    run->add_option("--sweep", options->sweep,
                    "solve the rows of one tick with every solver over its tolerances, to a CSV file: headless the "
                    "last tick; in a window, which also plots it, the tick at three fifths of --seconds");
    run->add_option("--plots", options->plots, "plots shown when the window opens: time, contact, friction or trade")
        ->check(CLI::IsMember({"time", "contact", "friction", "trade"}));
    addUiScale(*run, options->uiScale);
    run->add_option("--select", options->select, "name of the part that is selected in the window at the start");
    run->add_option(
        "--screenshot", options->screenshot,
        "write a picture to a PNG file: in a window, of the last frame; headless, of the last tick with --seconds, "
        "else of the tick with the largest force within the device's limits, if any is felt");
    run->add_option(
        "--pictures", options->pictures,
        "headless: write pictures of the first tick, of the one with the largest force and of the last to a "
        "folder: 1-before.png, 2-contact.png, 3-end.png");
    run->add_option("--show", options->show,
                    "overlays to draw, comma-separated: " + namesOf(sandbox::displaySwitches()) +
                        "; no-NAME hides one, trees:LEVEL, section:x");
    run->add_option("--view", options->view,
                    "direction of the view: front, back, left, right, top, bottom, or contact: close to the contact");
    run->add_flag_callback(
        "--help-settings",
        [] {
            printSettings();
            throw CLI::Success();
        },
        "list the keys of --set and exit");
    run->callback([options, &action] { action = [options] { return runScene(*options); }; });
}

}  // namespace touchstone::app
