#include "haptics/sandbox/exchange/demonstration.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "engine/scene/gltf_load.hpp"
#include "haptics/loop/distances.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/math/hash.hpp"
#include "haptics/sandbox/record/recording.hpp"
#include "haptics/sandbox/record/recording_json.hpp"
#include "haptics/sandbox/record/tick_fields.hpp"
#include "haptics/sandbox/session/replay_pass.hpp"

namespace touchstone::sandbox {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// What a policy may observe: columns of the tick, side by side.
struct Observation {
    const char *name, *first;
    std::size_t width;
    const char* help;
};
constexpr Observation kObservations[] = {
    {"obs/device_pose", "device_x_mm", 7, "device pose, scene frame"},
    {"obs/tool_pose", "tool_x_mm", 7, "tool pose, scene frame"},
    {"obs/wrench", "force_o_x_N", 6, "on the hand, about the tool node's origin, world axes"},
    {"obs/rows", "rows", 1, "number of contact rows"},
};

/// The place of a column in a packed tick.
struct Place {
    std::size_t field, offset;
};
Place placeOf(std::string_view column) {
    Place place{0, 0};
    for (const TickField& field : tickFields()) {
        if (field.name == column) return place;
        place.offset += field.size();
        ++place.field;
    }
    throw std::invalid_argument("no column is named '" + std::string(column) + "'");
}

template <class T>
std::string bytesOf(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::string textOf(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

/// The larger one; a deviation that is not a number exceeds every tolerance.
void raise(double& largest, double deviation) {
    if (!(deviation <= largest)) largest = std::isnan(deviation) ? INFINITY : deviation;
}

/// The first field that repeats and has other bits.
std::string firstDifference(const RecordedTick& recorded, const RecordedTick& replayed) {
    std::string a(tickRowBytes(), '\0'), b = a;
    packTick(recorded, a.data());
    packTick(replayed, b.data());
    std::size_t offset = 0;
    for (const TickField& field : tickFields()) {
        if (field.repeats && std::memcmp(a.data() + offset, b.data() + offset, field.size()) != 0) {
            std::string text = std::string(field.name) + " is ";
            appendField(text, field, recorded);
            text += ", the replay gives ";
            appendField(text, field, replayed);
            return text;
        }
        offset += field.size();
    }
    return {};
}

void compare(Agreement& agreement, const RecordedTick& recorded, const RecordedTick& replayed) {
    ++agreement.ticks;
    if (sameBits(recorded, replayed)) {
        ++agreement.same;
        return;
    }
    if (!agreement.different) {
        agreement.different = agreement.ticks - 1;
        agreement.where = firstDifference(recorded, replayed);
    }
    const TickRecord &a = recorded.record, &b = replayed.record;
    raise(agreement.position, (a.X_WT.p - b.X_WT.p).norm());
    // The angle between rotations is twice the distance of their quaternions, up to third order; q and -q are the same
    // rotation.
    const auto &p = a.X_WT.q.coeffs(), &q = b.X_WT.q.coeffs();
    raise(agreement.angle, 2 * std::min((p - q).norm(), (p + q).norm()));
    for (const auto& [was, is] : {std::pair{&a.wrench_C, &b.wrench_C}, std::pair{&a.wrench_o, &b.wrench_o}}) {
        raise(agreement.force, (was->force - is->force).norm());
        raise(agreement.torque, (was->torque - is->torque).norm());
    }
}

ordered_json toJson(const GoalRegion& goal) {
    const Pose& X = goal.X_WT;
    return {{"pose", {X.p.x(), X.p.y(), X.p.z(), X.q.w(), X.q.x(), X.q.y(), X.q.z()}},
            {"tolerance_mm", goal.tolerance},
            {"tolerance_rad", goal.toleranceAngle},
            {"depth_mm", goal.depth},
            {"fold", goal.fold}};
}

std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2g", value);
    return text;
}

/// Throws if the replay does not prove the demonstration.
void requireAgreement(const fs::path& recording, const Agreement& agreement, const ReplayCheck& check) {
    const auto fail = [&](const std::string& what) { throw std::runtime_error(recording.string() + ": " + what); };
    if (!check.otherPart.empty()) fail(check.otherPart);
    if (check.notCompared > 0)
        fail("it lacks ticks, and the " + std::to_string(check.notCompared) +
             " ticks after them cannot be confirmed: record it again");
    if (!agreement.different) return;
    const std::string row =
        "row " + std::to_string(*agreement.different) + " differs from its replay: " + agreement.where + "; ";
    if (agreement.otherBuild.empty())
        fail(row + "the build is the same, so a tick, a setting or the scene was changed after it was recorded");
    if (!agreement.withinTolerance())
        fail(row + "the largest deviations are " + number(agreement.position) + " mm, " + number(agreement.angle) +
             " rad, " + number(agreement.force) + " N and " + number(agreement.torque) +
             " mN·m, more than another build explains (" + agreement.otherBuild.front() + ")");
}

}  // namespace

bool Agreement::withinTolerance() const {
    return position <= kTolerance.position && angle <= kTolerance.angle && force <= kTolerance.force &&
           torque <= kTolerance.torque;
}

std::vector<SceneFile> sceneFiles(const fs::path& file) {
    const std::string scene = hashOf(file);
    std::vector<SceneFile> files{{scene, file.filename(), scene, file}};
    for (const fs::path& name : engine::externalFiles(file)) {
        const fs::path place = file.parent_path() / name;
        files.push_back({scene, name, hashOf(place), place});
    }
    return files;
}

const char* Demonstration::at(std::size_t tick, std::string_view column) const {
    return rows.data() + tick * tickRowBytes() + placeOf(column).offset;
}

std::vector<std::uint64_t> chainOf(std::string_view notes, std::string_view rows) {
    std::vector<std::uint64_t> chain(rows.size() / tickRowBytes());
    std::uint64_t link = Hash().add(notes.data(), notes.size()).value();
    for (std::size_t i = 0; i < chain.size(); ++i)
        link = chain[i] = Hash().add(link).add(rows.data() + i * tickRowBytes(), tickRowBytes()).value();
    return chain;
}

std::vector<Array> arraysOf(const Demonstration& demo) {
    const std::size_t n = demo.ticks();
    std::vector<Array> arrays{{"ticks", "", 1, demo.rows, "every tick with all columns: what verify replays"},
                              {"chain", "<u8", 1, bytesOf(demo.chain),
                               "hash of the tick and of the link before; the first continues that of recording.json"},
                              {"t_ms", "<f8", 1, bytesOf(demo.time), "simulated time since the first tick"}};
    for (const Observation& observation : kObservations) {
        const Place place = placeOf(observation.first);
        const std::size_t bytes = tickFields()[place.field].size() * observation.width;
        std::string help = std::string(observation.help) + ": ", values;
        for (std::size_t i = 0; i < observation.width; ++i)
            help += (i ? ", " : "") + std::string(tickFields()[place.field + i].name);
        values.reserve(n * bytes);
        for (std::size_t i = 0; i < n; ++i) values.append(demo.rows, i * tickRowBytes() + place.offset, bytes);
        arrays.push_back(
            {observation.name, tickFields()[place.field].type(), observation.width, std::move(values), help});
    }

    std::vector<double> actions(6 * n, 0.0), rewards(n, 0.0);
    std::string dones(n, '\0');
    const auto devicePose = [&](std::size_t i) {
        double v[7];
        std::memcpy(v, demo.at(i, "device_x_mm"), sizeof v);
        return Pose{{v[0], v[1], v[2]}, Quat(v[3], v[4], v[5], v[6])};
    };
    for (std::size_t i = 0; i < n; ++i) {
        rewards[i] = demo.inGoal[i];
        if (i + 1 < n) Eigen::Map<Vec6>(actions.data() + 6 * i) = incrementBetween(devicePose(i), devicePose(i + 1));
    }
    if (n > 0) dones.back() = 1;
    arrays.push_back(
        {"actions", "<f8", 6, bytesOf(actions),
         "motion of the device pose to the next tick, world axes: translation in mm, rotation vector in rad"});
    arrays.push_back({"rewards", "<f8", 1, bytesOf(rewards), "1 while the tool is in the goal region"});
    arrays.push_back({"dones", "|u1", 1, std::move(dones), "1 in the last tick"});
    return arrays;
}

const HapticScene& SceneShelf::open(const fs::path& file, bool allTrees, const Settings& settings) {
    std::error_code error;
    const std::string key = fs::weakly_canonical(file, error).string() + hashOf(file) + (allTrees ? "+" : "-") +
                            std::to_string(static_cast<int>(geometryOf(settings)));
    if (key != key_) {
        key_.clear();
        scene_ = openScene(file, {.treeCache = treeCacheFolder(),
                                  .progress = progress_,
                                  .allTrees = allTrees,
                                  .adjust = [&](const Settings&) { return settings; }});
        if (!scene_.world) throw std::runtime_error(file.string() + ": " + scene_.missing);
        key_ = key;
    }
    return scene_;
}

Demonstration replayDemonstration(const fs::path& folder, std::string name, SceneShelf& scenes) {
    Demonstration demo;
    demo.name = std::move(name);
    demo.notes = textOf(folder / kNotesFile);
    const Recording recording(folder);
    demo.device = recording.device();
    demo.settings = toJson(recording.settings(), nullptr);
    if (recording.rows() == 0) throw std::runtime_error(folder.string() + ": it has no ticks");
    const HapticScene& scene =
        scenes.open(scenes.find(recording.scene(), folder), hadSpheres(recording.scene()), recording.settings());
    if (scene.roles.goal) demo.goal = toJson(*scene.roles.goal);

    ReplayPass pass(scene, folder, {});
    demo.agreement.otherBuild = recording.programDifferences();
    std::optional<PenetrationMeter> meter;
    std::shared_ptr<const World> world;
    double t = 0;
    for (TickRecord record; pass.next(record, {}, false);) {
        const RecordedTick& recorded = pass.recorded();
        if (pass.world() != world) {
            world = pass.world();
            meter.emplace(*world);
            demo.scenes.push_back(pass.scene());
        }
        raise(demo.penetration, meter->depth(record.X_WT, pass.state().obstacles(), geometryOf(pass.settings())));
        demo.time.push_back(t);
        t += 1000 / pass.settings().rate;
        demo.inGoal.push_back(pass.tick().session == 0 && scene.roles.goal &&
                              scene.roles.goal->contains(recorded.record.X_WT));
        demo.rows.resize(demo.rows.size() + tickRowBytes());
        packTick(recorded, demo.rows.data() + demo.rows.size() - tickRowBytes());
        compare(demo.agreement, recorded, pass.tick());
    }
    requireAgreement(folder, demo.agreement, pass.check());
    demo.chain = chainOf(demo.notes, demo.rows);
    return demo;
}

}  // namespace touchstone::sandbox
