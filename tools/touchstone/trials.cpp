// touchstone trials: runs the trials of a protocol that its folder does not contain yet.
#include "tools/touchstone/trials.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <deque>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/ui/user_files.hpp"
#include "haptics/device/emergency_stop.hpp"
#include "haptics/files/output_file.hpp"
#include "haptics/sandbox/app/app_window.hpp"
#include "haptics/sandbox/measure/goal_check.hpp"
#include "haptics/sandbox/record/recorded_scene.hpp"
#include "haptics/sandbox/session/device_choice.hpp"
#include "haptics/sandbox/trials/live_trials.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/csv.hpp"
#include "tools/touchstone/scene_path.hpp"
#include "tools/touchstone/shard.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;
using sandbox::Condition;
using sandbox::Protocol;
using sandbox::Trial;

struct TrialsCommand {
    fs::path protocol, out;
    std::string shard;  ///< K/N; empty: all trials, and their summary
    bool headless = false;
    std::optional<float> uiScale;  ///< of the window
};

struct TrialsSummaryCommand {
    std::vector<fs::path> folders;  ///< the --out folder of each shard
    fs::path out;
};

/// Scenes by their names in the protocol, each opened once, and again when a condition needs sphere trees.
class Scenes {
  public:
    const sandbox::HapticScene& open(const Condition& condition) {
        auto& scene = scenes_[condition.scene];
        const auto adjust = [&](const Settings& ofScene) { return condition.settings(ofScene); };
        if (!scene || (geometryOf(adjust(scene->settings)) == Geometry::Spheres && !scene->world->hasSpheres()))
            scene = std::make_unique<sandbox::HapticScene>(sandbox::openScene(
                findScene(condition.scene),
                {.treeCache = sandbox::treeCacheFolder(), .progress = progressBar(), .adjust = adjust}));
        return *scene;
    }

  private:
    std::map<std::string, std::unique_ptr<sandbox::HapticScene>> scenes_;
};

/// A scene file that does not lie in the working folder may lie beside the protocol.
std::string besideProtocol(const fs::path& protocol, const std::string& scene) {
    std::error_code error;
    const fs::path beside = protocol.parent_path() / scene;
    return !fs::exists(scene, error) && fs::is_regular_file(beside, error) ? beside.string() : scene;
}

/// Finds the errors in a condition before the first trial, without building sphere trees. A goal that the tool cannot
/// reach is a warning, once a scene.
void checkCondition(const Condition& condition, bool headless, std::set<std::string>& scenes) {
    sandbox::SceneOptions options;
    options.buildWorld = scenes.insert(condition.scene).second;
    options.trees = false;
    const sandbox::HapticScene scene = sandbox::openScene(findScene(condition.scene), options);
    const auto fail = [&](const std::string& what) {
        throw std::runtime_error("condition '" + condition.name + "': " + what);
    };
    if (!scene.missing.empty()) fail(scene.missing);
    if (!scene.roles.goal) fail("the scene '" + condition.scene + "' has no goal: give a node the role goal");
    if (scene.world)
        if (const std::string doubt = sandbox::goalDoubt(*scene.world, *scene.roles.goal); !doubt.empty())
            spdlog::warn("{}: {}", engine::escaped(sandbox::sceneName(scene)), doubt);
    condition.settings(scene.settings);
    sandbox::startDevice(scene, condition.device, headless ? nullptr : std::make_shared<MouseTarget>());
}

/// Reserves the folder for this protocol, or checks that an earlier run did.
void claim(const fs::path& folder, const Protocol& protocol) {
    makeFolder(folder, "the trials");
    const fs::path file = folder / kProtocolFile;
    if (!fs::exists(file)) {
        writeFile(file, "the protocol", protocol.source.dump(1) + "\n");
    } else if (sandbox::readProtocol(file).source != protocol.source) {
        throw std::runtime_error("'" + folder.string() +
                                 "' contains trials of another protocol: choose another folder for --out");
    }
}

bool isRowOf(const TrialRow& row, const Protocol& protocol, const Trial& trial) {
    const TrialRow columns = sandbox::trialColumns(protocol, trial);
    return row.is_object() && std::all_of(columns.items().begin(), columns.items().end(), [&](const auto& column) {
               return row.contains(column.key()) && row[column.key()] == column.value();
           });
}

/// An empty folder for a trial; the remains of an interrupted run are removed.
fs::path emptyFolder(const fs::path& study, const Trial& trial) {
    const fs::path folder = trialFolder(study, trial.number);
    fs::remove_all(folder);
    return folder;
}

/// Writes the row, after the recording is complete: a trial counts as done if it has a row.
void finish(const fs::path& study, const Protocol& protocol, const Trial& trial, const TrialRow& row) {
    writeFile(trialFolder(study, trial.number) / kRowFile, "the row", row.dump(1) + "\n");
    std::fprintf(stderr, "trial %d, %s, %s: %s after %.2f s\n", trial.number,
                 row.at("participant").get<std::string>().c_str(), row.at("condition").get<std::string>().c_str(),
                 row.at("outcome").get<std::string>().c_str(), row.at("time_s").get<double>());
    writeTable(study, readRows({study}, protocol));
}

void runTrialsHeadless(const Protocol& protocol, const std::deque<Trial>& queue, const fs::path& study) {
    Scenes scenes;
    for (const Trial& trial : queue) {
        const Condition& condition = protocol.conditions[static_cast<std::size_t>(trial.condition)];
        const auto row = sandbox::runTrial(scenes.open(condition), protocol, trial, emptyFolder(study, trial),
                                           engine::configFolder(), sayOnConsole);
        if (!row) return;  // stopped by a signal
        finish(study, protocol, trial, *row);
    }
}

void runTrialsInWindow(const Protocol& protocol, const std::deque<Trial>& queue, const fs::path& study,
                       std::optional<float> uiScale) {
    sandbox::LiveTrials live(
        protocol, {.queue = queue,
                   .sceneFile = findScene,
                   .folder = [&](const Trial& trial) { return emptyFolder(study, trial); },
                   .done = [&](const Trial& trial, const TrialRow& row) { finish(study, protocol, trial, row); }});
    sandbox::LiveSession* session = nullptr;  // set in the first frame
    sandbox::WindowRunOptions window;
    window.scene = findScene(protocol.conditions[static_cast<std::size_t>(queue.front().condition)].scene);
    window.configFolder = engine::configFolder();
    window.window.uiScale = uiScale;
    window.session.device = live.restingDevice();
    window.session.adjust = [&](const Settings& scene) { return live.settings(scene); };
    window.session.onTick = [&](const TickRecord& tick) {
        if (session) live.add(tick, *session);
    };
    window.onFrame = [&](sandbox::WindowFrame& frame) {
        session = &frame.session;
        live.update(frame.session);
    };
    window.study = true;
    window.panel = [&](sandbox::LiveSession& shown, const glm::vec4& picture, engine::ItemRects& items) {
        live.draw(shown, picture, &items);
    };
    sandbox::runWindow(window);
}

}  // namespace

fs::path trialFolder(const fs::path& study, int trial) {
    char name[32];
    std::snprintf(name, sizeof name, "trial-%04d", trial);
    return study / name;
}

std::vector<TrialRow> readRows(const std::vector<fs::path>& studies, const Protocol& protocol, SceneHashes scenes) {
    std::vector<TrialRow> rows;
    for (const Trial& trial : protocol.trials()) {
        const TrialRow* found = nullptr;
        for (const fs::path& study : studies) {
            const fs::path file = trialFolder(study, trial.number) / kRowFile;
            std::ifstream in(file);
            if (!in) continue;
            if (found)
                throw std::runtime_error(file.string() +
                                         ": this trial is also in another of the folders: leave one of "
                                         "them out");
            TrialRow row = TrialRow::parse(in, nullptr, false);
            if (!isRowOf(row, protocol, trial) || (!rows.empty() && row.size() != rows.front().size()))
                throw std::runtime_error(file.string() +
                                         ": this row does not belong to this trial of the study: remove its folder, "
                                         "and run the trial again");
            const std::string& name = protocol.conditions[static_cast<std::size_t>(trial.condition)].scene;
            const TrialRow hash = row.value("scene_hash", TrialRow());
            if (scenes.try_emplace(name, hash).first->second != hash)
                throw std::runtime_error(file.string() + ": the scene '" + name +
                                         "' has changed since this trial or differs from other trials: remove the "
                                         "trial's folder and run it again, or choose another folder for --out");
            found = &rows.emplace_back(std::move(row));
        }
    }
    return rows;
}

void writeTable(const fs::path& folder, const std::vector<TrialRow>& rows) {
    writeFile(folder / "trials.csv", "the table", toCsv(rows));
}

namespace {

int trials(const TrialsCommand& command) {
    const Shard shard = shardOf(command.shard);
    Protocol protocol = sandbox::readProtocol(command.protocol);
    for (Condition& condition : protocol.conditions)
        condition.scene = besideProtocol(command.protocol, condition.scene);
    if (!command.headless) requireDisplay();
    if (command.headless && command.uiScale) throw UsageError("--ui-scale needs a window: leave out --headless");
    SceneHashes scenes;
    std::set<std::string> checked;
    for (const Condition& condition : protocol.conditions) {
        checkCondition(condition, command.headless, checked);
        scenes[condition.scene] = sandbox::hashOf(findScene(condition.scene));
    }
    claim(command.out, protocol);

    const std::vector<Trial> all = protocol.trials();
    readRows({command.out}, protocol, scenes);  // reports their errors before the first trial
    std::deque<Trial> queue;
    for (std::size_t i = shard.k - 1; i < all.size(); i += shard.n)
        if (!fs::exists(trialFolder(command.out, all[i].number) / kRowFile)) queue.push_back(all[i]);
    const StopRequest stop;
    if (!queue.empty()) {
        if (command.headless)
            runTrialsHeadless(protocol, queue, command.out);
        else
            runTrialsInWindow(protocol, queue, command.out, command.uiScale);
    }

    const std::vector<TrialRow> rows = readRows({command.out}, protocol, scenes);
    writeTable(command.out, rows);
    const bool stopped = StopRequest::signal() != 0;
    if (command.shard.empty() && !rows.empty() && !stopped) summarize(command.out, rows, protocol);
    std::printf("%zu of %zu trials are in %s%s\n", rows.size(), all.size(),
                (command.out / "trials.csv").string().c_str(), stopped ? ": stopped; the same command continues" : "");
    return stopped ? kSignalled + StopRequest::signal() : kOk;
}

}  // namespace

int runStudy(const fs::path& protocol, const fs::path& out) {
    TrialsCommand command{.protocol = protocol, .out = out, .shard = {}, .headless = true, .uiScale = {}};
    return trials(command);
}

namespace {

int summarizeTrials(const TrialsSummaryCommand& command) {
    for (const fs::path& folder : command.folders)
        if (!fs::exists(folder / kProtocolFile))
            throw std::runtime_error("'" + folder.string() +
                                     "' contains no trials: give the --out folders of `touchstone trials`");
    const Protocol protocol = sandbox::readProtocol(command.folders.front() / kProtocolFile);
    for (const fs::path& folder : command.folders)
        if (sandbox::readProtocol(folder / kProtocolFile).source != protocol.source)
            throw std::runtime_error("'" + folder.string() + "' contains trials of another protocol than '" +
                                     command.folders.front().string() + "': summarize them separately");
    const std::vector<TrialRow> rows = readRows(command.folders, protocol);
    if (rows.empty()) throw std::runtime_error("no trial is complete in these folders: run `touchstone trials` first");
    makeFolder(command.out, "the summary");
    writeTable(command.out, rows);
    summarize(command.out, rows, protocol);
    std::printf("%zu of %zu trials are in %s\n", rows.size(), protocol.trials().size(),
                (command.out / "trials.csv").string().c_str());
    return kOk;
}

constexpr const char* kTrialsFooter =
    "A study can be interrupted at any time: the same command continues it.\n\n"
    "Examples:\n"
    "  touchstone trials study.json --headless --out study\n"
    "  touchstone trials study.json --headless --shard 2/8 --out part-2\n"
    "  touchstone trials summary part-* --out study\n";

const CLI::App* addTrialsSummary(CLI::App& trials, Action& action) {
    const auto options = std::make_shared<TrialsSummaryCommand>();
    CLI::App* summary =
        addCommand(trials, "summary", "Join shards: one table, means with confidence intervals, figures",
                   "Figures need python3-matplotlib.\n\nExample:\n  touchstone trials summary part-* --out study\n");
    summary->add_option("DIR", options->folders, "the --out folder of each shard")->required();
    summary->add_option("--out", options->out, "folder for the table, the summary and its figures")->required();
    summary->callback([options, &action] { action = [options] { return summarizeTrials(*options); }; });
    return summary;
}

}  // namespace

void addTrials(CLI::App& program, Action& action) {
    const auto options = std::make_shared<TrialsCommand>();
    CLI::App* command = addCommand(program, "trials", "Run an assembly study", kTrialsFooter);
    const CLI::Option* protocol =
        command->add_option("PROTOCOL", options->protocol, "the study, a JSON file (see docs/trials.md)");
    const CLI::Option* out =
        command->add_option("--out", options->out,
                            "folder for the recording of each trial, trials.csv and the summary; trials that it "
                            "already contains are not repeated");
    command->add_option("--shard", options->shard,
                        "K/N: run the K-th of N parts without a summary, for `touchstone trials summary`");
    command->add_flag("--headless", options->headless,
                      "without a window, as fast as possible; otherwise a panel in the window guides the participant");
    addUiScale(*command, options->uiScale);
    const CLI::App* summary = addTrialsSummary(*command, action);
    command->callback([options, summary, protocol, out, &action] {
        if (summary->parsed()) return;
        if (protocol->empty() || out->empty()) throw CLI::RequiredError("PROTOCOL and --out");
        action = [options] { return trials(*options); };
    });
}

}  // namespace touchstone::app
