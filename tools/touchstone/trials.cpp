// touchstone trials: runs what a protocol asks for and the folder does not hold yet.
#include "tools/touchstone/trials.hpp"

#include <algorithm>
#include <cstdio>
#include <deque>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "engine/ui/user_files.hpp"
#include "haptics/device/emergency_stop.hpp"
#include "haptics/files/output_file.hpp"
#include "haptics/sandbox/app/app_window.hpp"
#include "haptics/sandbox/record/recorded_scene.hpp"
#include "haptics/sandbox/session/device_choice.hpp"
#include "haptics/sandbox/trials/live_trials.hpp"
#include "tools/touchstone/bench.hpp"
#include "tools/touchstone/commands.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/gnuplot.hpp"
#include "tools/touchstone/scene_path.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;
using sandbox::Condition;
using sandbox::Protocol;
using sandbox::Trial;

/// Scenes by the name in the protocol, each opened once.
class Scenes {
  public:
    const sandbox::HapticScene& open(const Condition& condition) {
        auto& scene = scenes_[condition.scene];
        if (!scene)
            scene = std::make_unique<sandbox::HapticScene>(sandbox::openScene(
                findScene(condition.scene), {.treeCache = sandbox::treeCacheFolder(), .progress = progressBar()}));
        return *scene;
    }

  private:
    std::map<std::string, std::unique_ptr<sandbox::HapticScene>> scenes_;
};

/// Finds what is wrong with a condition before the first trial, without its trees.
void lookInto(const Condition& condition, bool headless) {
    sandbox::SceneOptions options;
    options.buildTrees = false;
    const sandbox::HapticScene scene = sandbox::openScene(findScene(condition.scene), options);
    const auto fail = [&](const std::string& what) {
        throw std::runtime_error("condition '" + condition.name + "': " + what);
    };
    if (!scene.missing.empty()) fail(scene.missing);
    if (!scene.roles.goal) fail("the scene '" + condition.scene + "' has no goal: give a node the role goal");
    condition.settings(scene.settings);
    sandbox::startDevice(scene, condition.device, headless ? nullptr : std::make_shared<MouseTarget>());
}

/// The folder belongs to this protocol, now or since an earlier run.
void claim(const fs::path& folder, const Protocol& protocol) {
    makeFolder(folder, "the trials");
    const fs::path file = folder / kProtocolFile;
    if (!fs::exists(file)) {
        writeFile(file, "the protocol", protocol.source.dump(1) + "\n");
    } else if (sandbox::readProtocol(file).source != protocol.source) {
        throw std::runtime_error("'" + folder.string() +
                                 "' holds trials of another protocol: choose another folder for --out");
    }
}

bool isRowOf(const TrialRow& row, const Protocol& protocol, const Trial& trial) {
    const TrialRow columns = sandbox::trialColumns(protocol, trial);
    return row.is_object() && std::all_of(columns.items().begin(), columns.items().end(), [&](const auto& column) {
               return row.contains(column.key()) && row[column.key()] == column.value();
           });
}

/// An empty folder for a trial: what an interrupted run left of it goes.
fs::path freshFolder(const fs::path& study, const Trial& trial) {
    const fs::path folder = trialFolder(study, trial.number);
    fs::remove_all(folder);
    return folder;
}

/// The recording is whole by now; with its row the trial counts as done.
void finish(const fs::path& study, const Protocol& protocol, const Trial& trial, const TrialRow& row) {
    writeFile(trialFolder(study, trial.number) / kRowFile, "the row", row.dump(1) + "\n");
    std::fprintf(stderr, "trial %d, %s, %s: %s after %.2f s\n", trial.number,
                 row.at("participant").get<std::string>().c_str(), row.at("condition").get<std::string>().c_str(),
                 row.at("outcome").get<std::string>().c_str(), row.at("time_s").get<double>());
    writeTable(study, readRows({study}, protocol));
}

void runHeadless(const Protocol& protocol, const std::deque<Trial>& queue, const fs::path& study) {
    Scenes scenes;
    for (const Trial& trial : queue) {
        const Condition& condition = protocol.conditions[static_cast<std::size_t>(trial.condition)];
        const auto row = sandbox::runTrial(scenes.open(condition), protocol, trial, freshFolder(study, trial));
        if (!row) return;  // asked to stop
        finish(study, protocol, trial, *row);
    }
}

void runInWindow(const Protocol& protocol, const std::deque<Trial>& queue, const fs::path& study) {
    sandbox::LiveTrials live(
        protocol, {.queue = queue,
                   .sceneFile = findScene,
                   .folder = [&](const Trial& trial) { return freshFolder(study, trial); },
                   .done = [&](const Trial& trial, const TrialRow& row) { finish(study, protocol, trial, row); }});
    sandbox::LiveSession* session = nullptr;  // known from the first frame on
    sandbox::WindowRunOptions window;
    window.scene = findScene(protocol.conditions[static_cast<std::size_t>(queue.front().condition)].scene);
    window.configFolder = engine::configFolder();
    window.session.device = live.restingDevice();
    window.session.adjust = [&](const Settings& scene) { return live.settings(scene); };
    window.session.onTick = [&](const TickRecord& tick) {
        if (session) live.add(tick, *session);
    };
    window.onFrame = [&](sandbox::WindowFrame& frame) {
        session = &frame.session;
        live.update(frame.session);
    };
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
                                         ": this trial is in another of the folders too: leave one of "
                                         "them out");
            TrialRow row = TrialRow::parse(in, nullptr, false);
            if (!isRowOf(row, protocol, trial) || (!rows.empty() && row.size() != rows.front().size()))
                throw std::runtime_error(file.string() +
                                         ": this is no row of this trial of the study: remove the folder around it, "
                                         "and run the trial again");
            const std::string& name = protocol.conditions[static_cast<std::size_t>(trial.condition)].scene;
            const TrialRow hash = row.value("scene_hash", TrialRow());
            if (scenes.try_emplace(name, hash).first->second != hash)
                throw std::runtime_error(file.string() + ": the scene '" + name +
                                         "' was another in this trial than in others or is now: remove the folder "
                                         "around it, and run the trial again, or choose another folder for --out");
            found = &rows.emplace_back(std::move(row));
        }
    }
    return rows;
}

void writeTable(const fs::path& folder, const std::vector<TrialRow>& rows) {
    writeFile(folder / "trials.csv", "the table", toCsv(rows));
}

int trials(const TrialsCommand& command) {
    const Shard shard = shardOf(command.shard);
    const Protocol protocol = sandbox::readProtocol(command.protocol);
    if (command.shard.empty()) requireGnuplot();
    if (!command.headless) requireDisplay();
    SceneHashes scenes;
    for (const Condition& condition : protocol.conditions) {
        lookInto(condition, command.headless);
        scenes[condition.scene] = sandbox::hashOf(findScene(condition.scene));
    }
    claim(command.out, protocol);

    const std::vector<Trial> all = protocol.trials();
    readRows({command.out}, protocol, scenes);  // what is wrong with them is told before the first trial
    std::deque<Trial> queue;
    for (std::size_t i = shard.k - 1; i < all.size(); i += shard.n)
        if (!fs::exists(trialFolder(command.out, all[i].number) / kRowFile)) queue.push_back(all[i]);
    const StopRequest stop;
    if (!queue.empty()) (command.headless ? runHeadless : runInWindow)(protocol, queue, command.out);

    const std::vector<TrialRow> rows = readRows({command.out}, protocol, scenes);
    writeTable(command.out, rows);
    const bool stopped = StopRequest::signal() != 0;
    if (command.shard.empty() && !rows.empty() && !stopped) summarise(command.out, rows, protocol);
    std::printf("%zu of %zu trials are in %s%s\n", rows.size(), all.size(),
                (command.out / "trials.csv").string().c_str(),
                stopped ? ": stopped, and the same command continues" : "");
    return stopped ? kSignalled + StopRequest::signal() : kOk;
}

int summariseTrials(const TrialsSummaryCommand& command) {
    requireGnuplot();
    for (const fs::path& folder : command.folders)
        if (!fs::exists(folder / kProtocolFile))
            throw std::runtime_error("'" + folder.string() +
                                     "' holds no trials: give the folders that --out of `touchstone trials` was");
    const Protocol protocol = sandbox::readProtocol(command.folders.front() / kProtocolFile);
    for (const fs::path& folder : command.folders)
        if (sandbox::readProtocol(folder / kProtocolFile).source != protocol.source)
            throw std::runtime_error("'" + folder.string() + "' holds trials of another protocol than '" +
                                     command.folders.front().string() + "': summarise them apart");
    const std::vector<TrialRow> rows = readRows(command.folders, protocol);
    if (rows.empty()) throw std::runtime_error("no trial is done yet in these folders: run `touchstone trials` first");
    makeFolder(command.out, "the summary");
    writeTable(command.out, rows);
    summarise(command.out, rows, protocol);
    std::printf("%zu of %zu trials are in %s\n", rows.size(), protocol.trials().size(),
                (command.out / "trials.csv").string().c_str());
    return kOk;
}

}  // namespace touchstone::app
