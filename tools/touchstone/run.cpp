#include <spdlog/spdlog.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>

#include "haptics/device/mouse.hpp"
#include "haptics/system/app_window.hpp"
#include "haptics/system/device_choice.hpp"
#include "haptics/system/headless_run.hpp"
#include "haptics/system/scene_view.hpp"
#include "haptics/system/user_files.hpp"
#include "tools/touchstone/commands.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/qp_file.hpp"
#include "tools/touchstone/run_report.hpp"
#include "tools/touchstone/scene_path.hpp"
#include "tools/touchstone/settings_choice.hpp"

namespace touchstone::app {
namespace {

constexpr int kPictureWidth = 1600, kPictureHeight = 1000;

/// The scene's settings as the command line changes them.
Settings chosenSettings(const Settings& scene, const RunOptions& options) {
    const Settings settings = withCommandLine(scene, options);
    if (const std::string wrong = checkSettings(settings); !wrong.empty()) throw UsageError(wrong);
    return settings;
}

std::unique_ptr<TickTable> tableFor(const RunOptions& options) {
    return options.ticks.empty() ? nullptr : std::make_unique<TickTable>(options.ticks);
}

/// The scene without its trees, which take their time: enough to find what is wrong with it, the settings or the
/// device.
system::HapticScene lookInto(const std::filesystem::path& file, const RunOptions& options, const std::string& device,
                             std::shared_ptr<MouseTarget> mouse) {
    system::SceneOptions sceneOptions;
    sceneOptions.buildTrees = false;
    system::HapticScene scene = system::openScene(file, sceneOptions);
    chosenSettings(scene.settings, options);
    if (scene.missing.empty() && !device.empty()) system::startDevice(scene, device, std::move(mouse));
    return scene;
}

system::HapticScene openForRun(const std::filesystem::path& file, const RunOptions& options,
                               const std::string& device) {
    system::HapticScene scene = lookInto(file, options, device, nullptr);
    if (!scene.missing.empty()) throw std::runtime_error(file.string() + ": " + scene.missing);
    for (const auto& [path, what] : {std::pair{options.report, "report"}, std::pair{options.screenshot, "picture"},
                                     std::pair{options.dumpQp, "problems"}})
        if (!path.empty()) requireWritable(path, what);

    scene =
        system::openScene(std::move(scene.scene), {.treeCache = system::treeCacheFolder(), .progress = progressBar()});
    for (const std::string& warning : scene.warnings) spdlog::warn("{}", warning);
    return scene;
}

int runHeadless(const RunOptions& options, const std::filesystem::path& file) {
    const std::unique_ptr<TickTable> table = tableFor(options);
    system::HeadlessOptions headless;
    if (!options.device.empty()) headless.device = options.device;
    headless.seconds = options.seconds;
    headless.paced = options.paced;
    const system::HapticScene scene = openForRun(file, options, headless.device);
    const Settings settings = chosenSettings(scene.settings, options);
    if (table)
        headless.onTick = [&](const TickRecord& record, double penetration) {
            table->add(record, penetration, settings.rate);
        };
    std::ofstream problems;
    if (!options.dumpQp.empty()) {
        problems.open(options.dumpQp, std::ios::binary);
        headless.onSolve = [&](const QpProblem& problem, const SolveResult& result) {
            problems << toLine(problem, result) << '\n';
        };
    }
    const system::HeadlessRun run = system::runHeadless(scene, settings, headless);
    problems.close();
    if (!options.dumpQp.empty() && !problems)
        throw std::runtime_error("cannot write the problems to '" + options.dumpQp.string() + "': is the disk full?");
    if (table) table->close();
    printReport(run.report);
    if (!options.report.empty()) writeReport(run.report, options.report);
    if (!options.screenshot.empty())
        system::renderScreenshot(scene, run.last, settings, {}, options.screenshot, kPictureWidth, kPictureHeight);
    return run.report.met() ? kOk : kOutcomeUnmet;
}

int runInWindow(const RunOptions& options, const std::filesystem::path& file) {
    lookInto(file, options, options.device, std::make_shared<MouseTarget>());
    const std::unique_ptr<TickTable> table = tableFor(options);
    LiveReport live(table.get());
    system::LiveSession* session = nullptr;  // known from the first frame on

    system::WindowRunOptions window;
    window.scene = file;
    window.sceneFolders = {sceneFolder()};
    window.configFolder = system::configFolder();
    window.session.device = options.device;
    window.session.adjust = [&](const Settings& settings) { return chosenSettings(settings, options); };
    window.seconds = options.seconds;
    window.screenshot = options.screenshot;
    if (table || !options.report.empty()) {
        window.onFrame = [&](system::WindowFrame& frame) { session = &frame.session; };
        window.session.onTick = [&](const TickRecord& record) {
            if (session) live.add(record, *session);
        };
        window.onEnd = [&](system::LiveSession& ended) {
            if (!options.report.empty()) writeReport(live.finish(ended), options.report);
        };
    }
    const int code = system::runWindow(window);
    if (table) table->close();
    return code;
}

bool hasDisplay() {
    const auto given = [](const char* variable) {
        const char* value = std::getenv(variable);
        return value && *value;
    };
    return given("DISPLAY") || given("WAYLAND_DISPLAY");
}

}  // namespace

int run(const RunOptions& options) {
    withCommandLine({}, options);  // what does not exist is told before a scene is read
    const std::filesystem::path file = findScene(options.scene);
    if (options.headless) return runHeadless(options, file);
    if (options.paced) throw UsageError("--paced belongs to a headless run: add --headless");
    if (!options.dumpQp.empty()) throw UsageError("--dump-qp belongs to a headless run: add --headless");
    if (!hasDisplay())
        throw std::runtime_error(
            "there is no display for a window: add --headless for a run without one, or start it on a desktop, over "
            "'ssh -X' or under 'xvfb-run'");
    return runInWindow(options, file);
}

void printSettings() {
    const Settings defaults;
    std::printf("Settings for --set KEY=VALUE and for extras.touchstone.settings of a scene:\n\n");
    for (const SettingInfo& info : settingTable()) {
        std::string value = getSetting(defaults, info.key);
        if (!info.unit.empty()) value += " " + std::string(info.unit);
        std::printf("  %-16s %-18s %s", std::string(info.key).c_str(), value.c_str(), std::string(info.help).c_str());
        if (info.max > info.min) std::printf(" (%g to %g)", info.min, info.max);
        std::printf("\n");
    }
    std::printf("\nSolvers:\n\n");
    for (const SolverInfo& solver : solverTable())
        std::printf("  %-16s %s\n", std::string(solver.name).c_str(), std::string(solver.summary).c_str());
}

}  // namespace touchstone::app
