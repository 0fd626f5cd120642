#include "haptics/sandbox/exchange/exchange.hpp"

#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <system_error>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/scene.hpp"
#include "haptics/files/output_file.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/math/hash.hpp"
#include "haptics/sandbox/exchange/demonstration_file.hpp"
#include "haptics/sandbox/record/build_info.hpp"
#include "haptics/sandbox/record/recording.hpp"
#include "haptics/sandbox/record/recording_json.hpp"
#include "haptics/sandbox/record/tick_file.hpp"

namespace touchstone::sandbox {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

std::string scientific(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2g", value);
    return text;
}

/// One line for a demonstration that was confirmed.
std::string confirmed(const Demonstration& demo) {
    const Agreement& agreement = demo.agreement;
    std::string line = demo.name + ": " + engine::escaped(demo.scenes.front().file.stem().string()) + ", " +
                       std::to_string(demo.ticks()) + " ticks, ";
    if (!agreement.different) {
        line += "all with the recorded bits";
        if (!agreement.otherBuild.empty()) line += " (" + agreement.otherBuild.front() + ")";
    } else {
        line += std::to_string(agreement.same) +
                " of them with the recorded bits, the others within the tolerance of another build (" +
                agreement.otherBuild.front() + "); row " + std::to_string(*agreement.different) +
                " is the first that differs: " + agreement.where + "; largest deviation " +
                scientific(agreement.position) + " mm, " + scientific(agreement.angle) + " rad, " +
                scientific(agreement.force) + " N, " + scientific(agreement.torque) + " mN·m";
    }
    return line + "; penetration at most " + scientific(demo.penetration) + " mm";
}

/// A folder for what is read out of a file, removed at the end.
class WorkFolder {
  public:
    WorkFolder() {
        std::string name = (fs::temp_directory_path() / "touchstone-verify-XXXXXX").string();
        if (!mkdtemp(name.data()))
            throw std::runtime_error("cannot make a folder in '" + fs::temp_directory_path().string() +
                                     "': " + std::generic_category().message(errno) + "; set TMPDIR to another one");
        path_ = name;
    }
    ~WorkFolder() {
        std::error_code error;
        fs::remove_all(path_, error);
    }
    WorkFolder(const WorkFolder&) = delete;
    WorkFolder& operator=(const WorkFolder&) = delete;
    const fs::path& path() const { return path_; }

  private:
    fs::path path_;
};

/// The scenes of a demonstration file, on disk.
class UnpackedScenes {
  public:
    /// `places`: where scenes are looked for first; `folder`: where those that the file carries are written.
    UnpackedScenes(const DemonstrationFile& file, const std::vector<fs::path>& places, const fs::path& folder)
        : file_(file) {
        for (const json& entry : file.manifest().at("files")) {
            const auto scene = entry.at("scene").get<std::string>();
            const SceneFile part{scene, entry.at("name").get<std::string>(), entry.at("hash").get<std::string>(),
                                 entry.at("place").get<std::string>()};
            if (scene.find_first_not_of("0123456789abcdef") != scene.npos || part.name.empty() ||
                part.name.is_absolute() || part.name.lexically_normal() != part.name || *part.name.begin() == "..")
                file.fail("it names a scene file outside its folder: " + engine::escaped(part.name.string()));
            if (entry.at("carried").get<bool>()) {
                const std::string_view bytes = file.part(partOf(part));
                if (hexadecimal(Hash().add(bytes.data(), bytes.size()).value()) != part.hash)
                    file.fail("its scene file " + part.name.string() + " is not the one that it names by hash");
                const fs::path to = folder / scene / part.name;
                fs::create_directories(to.parent_path());
                writeFile(to, "the scene", bytes);
                scenes_.try_emplace(scene, to);  // the scene is the first of its files
            } else {
                find(part, places);
            }
        }
    }

    /// Where the scene with this content is.
    fs::path at(const std::string& scene) const {
        const auto found = scenes_.find(scene);
        if (found == scenes_.end()) file_.fail("it lacks the scene with content hash " + engine::escaped(scene));
        return found->second;
    }

  private:
    /// A file that is only named: the scene at one of the places, where it was, or among the bundled ones; the files
    /// that it refers to with it.
    void find(const SceneFile& part, std::vector<fs::path> places) {
        const std::string name = engine::escaped(part.name.string());
        FoundFile found;
        if (const auto known = scenes_.find(part.scene); known != scenes_.end()) {
            found = findByContent(part.name, part.hash, {known->second.parent_path() / part.name}, {});
        } else {
            places.insert(places.end(), {part.place, bundledScenes()});
            found = findByContent(part.name, part.hash, places, places);
        }
        if (found.same) {
            scenes_.try_emplace(part.scene, found.file);
            return;
        }
        if (!found.file.empty())
            file_.fail("the scene or mesh file '" + found.file.string() +
                       "' was changed: the demonstrations need the one with content hash " + part.hash);
        file_.fail("the scene or mesh file " + name + " (content hash " + part.hash +
                   ") is missing: it is only named in this file, so put it beside it, or name it with --scene");
    }

    const DemonstrationFile& file_;
    std::map<std::string, fs::path> scenes_;
};

/// recording.json with the scenes where they are now.
std::string relocated(const fs::path& file, std::string_view notes, const UnpackedScenes& scenes) {
    json moved = engine::parseJson(file, std::string(notes));
    const auto move = [&](json& scene) { scene.at("file") = scenes.at(scene.at("hash").get<std::string>()).string(); };
    move(moved.at("scene"));
    for (json& change : moved.at("changes"))
        if (change.contains("scene")) move(change["scene"]);
    return moved.dump(1);
}

/// Whether two arrays agree: to the bit, or as numbers where a rotation vector came from another build's arctangent.
bool agree(const std::string& part, std::string_view a, std::string_view b) {
    if (a == b) return true;
    if (!part.ends_with("/actions") || a.size() != b.size()) return false;
    for (std::size_t i = 0; i + sizeof(double) <= a.size(); i += sizeof(double)) {
        double x = 0, y = 0;
        std::memcpy(&x, a.data() + i, sizeof x);
        std::memcpy(&y, b.data() + i, sizeof y);
        if (!(std::abs(x - y) <= 1e-12)) return false;  // actions are of order 1e-3: a few units in the last place
    }
    return true;
}

/// The demonstration of a file, replayed and compared with everything that the file says of it.
Demonstration verified(const DemonstrationFile& file, const json& entry, const UnpackedScenes& scenes,
                       const fs::path& folder, SceneShelf& shelf, std::size_t& messages) {
    const auto name = entry.at("name").get<std::string>();
    const std::string_view notes = file.part(partOf(name, "recording.json"));
    const std::string_view rows = file.part(partOf(name, "ticks"));
    fs::create_directories(folder);
    Demonstration demo;
    try {
        writeFile(folder / kNotesFile, "the recording", relocated(folder / kNotesFile, notes, scenes));
        writeFile(folder / kTicksFile, "the ticks", npyHeader({}, rows.size() / tickRowBytes()) + std::string(rows));
        demo = replayDemonstration(folder, name, shelf);
    } catch (const std::runtime_error& error) {
        std::string what = error.what();  // it names the folder
        for (std::size_t at; (at = what.find(folder.string())) != what.npos;)
            what.replace(at, folder.string().size(), name);
        file.fail(what);
    }
    fs::remove_all(folder);
    demo.notes = notes;
    demo.chain = chainOf(demo.notes, demo.rows);
    for (const auto& [part, bytes] : file.views(demo, messages))
        if (!agree(part, file.part(part), bytes)) file.fail(part + " does not follow from the ticks of " + name);
    json told = json::object();
    for (const auto& [key, value] : entry.at("settings").items()) told[std::string(settingKey(key))] = value;
    if (json(demo.settings) != told) file.fail("the settings of " + name + " are not those of its recording");
    const double slack = demo.agreement.otherBuild.empty() ? 0 : kTolerance.position;
    if (!(demo.penetration <= entry.at("penetration_mm").get<double>() + slack))
        file.fail(name + " penetrates by " + scientific(demo.penetration) + " mm, deeper than it says");
    return demo;
}

}  // namespace

void exportDemonstrations(const ExportRequest& request) {
    std::vector<std::unique_ptr<DemonstrationWriter>> writers;
    if (!request.hdf5.empty()) writers.push_back(makeHdf5Writer(request.hdf5));
    if (!request.mcap.empty()) writers.push_back(makeMcapWriter(request.mcap));
    ordered_json files = ordered_json::array(), demos = ordered_json::array();
    std::set<std::string> known;  // scenes
    SceneShelf shelf(request.progress, request.scene);
    for (const fs::path& recording : request.recordings) {
        const Demonstration demo = replayDemonstration(recording, "demo_" + std::to_string(demos.size()), shelf);
        for (const RecordedScene& scene : demo.scenes) {
            if (!known.insert(scene.hash).second) continue;
            for (const SceneFile& file : sceneFiles(scene.file)) {
                if (file.scene != scene.hash)
                    throw std::runtime_error(recording.string() + ": its scene '" + scene.file.string() +
                                             "' was changed since: its content hash is " + file.scene +
                                             ", recorded is " + scene.hash);
                const MappedFile content(file.place);
                files.push_back({{"scene", file.scene},
                                 {"name", file.name.generic_string()},
                                 {"hash", file.hash},
                                 {"bytes", content.bytes().size()},
                                 {"place", file.place.string()},
                                 {"carried", request.carryScenes}});
                if (request.carryScenes)
                    for (const auto& writer : writers) writer->addFile(partOf(file), content.bytes());
            }
        }
        for (const auto& writer : writers) writer->add(demo);
        const json notes = engine::parseJson(recording / kNotesFile, demo.notes);
        demos.push_back({{"name", demo.name},
                         {"scene", demo.scenes.front().file.filename().string()},
                         {"scene_hash", demo.scenes.front().hash},
                         {"device", demo.device},
                         {"ticks", demo.ticks()},
                         {"penetration_mm", demo.penetration},
                         {"chain", hexadecimal(demo.chain.back())},
                         {"goal_met", demo.goal.is_null() ? json() : json(demo.goalMet())},
                         {"settings", demo.settings},
                         {"recorded_by", notes.value("program", json())}});
        if (request.report) request.report(confirmed(demo));
    }
    const ordered_json manifest = {{"format", "touchstone demonstrations"},
                                   {"version", 1},
                                   {"program", buildInfo()},
                                   {"tolerance",
                                    {{"position_mm", kTolerance.position},
                                     {"angle_rad", kTolerance.angle},
                                     {"force_N", kTolerance.force},
                                     {"torque_mNm", kTolerance.torque}}},
                                   {"files", files},
                                   {"demonstrations", demos}};
    for (const auto& writer : writers) writer->finish(manifest);
}

void verifyDemonstrations(const fs::path& path, const SceneProgress& progress,
                          const std::function<void(const std::string&)>& report, const fs::path& scene) {
    SceneShelf shelf(progress, scene);
    if (fs::is_directory(path)) {
        report(confirmed(replayDemonstration(path, path.string(), shelf)));
        return;
    }
    const DemonstrationFile file(path);
    const WorkFolder work;
    try {
        const UnpackedScenes scenes(file, {scene, fs::absolute(path).parent_path()}, work.path() / "files");
        std::size_t messages = 0;
        for (const json& entry : file.manifest().at("demonstrations"))
            report(confirmed(verified(file, entry, scenes, work.path() / "demo", shelf, messages)));
    } catch (const json::exception& error) {
        file.fail("a text in it is not as `touchstone export` writes it (" + std::string(error.what()) + ")");
    }
}

}  // namespace touchstone::sandbox
