#include "haptics/sandbox/record/recording_json.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "haptics/loop/setting_table.hpp"
#include "haptics/loop/settings.hpp"

namespace touchstone::sandbox {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

ordered_json toJson(const Pose& X) { return {X.p.x(), X.p.y(), X.p.z(), X.q.w(), X.q.x(), X.q.y(), X.q.z()}; }

Pose readPose(const json& values, const char* key) {
    const auto finite = [](const json& v) { return v.is_number() && std::isfinite(v.get<double>()); };
    if (!values.is_array() || values.size() != 7 || !std::all_of(values.begin(), values.end(), finite))
        throw std::invalid_argument(std::string(key) + " must be seven numbers x, y, z, qw, qx, qy, qz");
    const auto v = values.get<std::vector<double>>();
    const Pose X{{v[0], v[1], v[2]}, Quat(v[3], v[4], v[5], v[6])};
    if (!X.isValid())
        throw std::invalid_argument(std::string(key) +
                                    " must be a pose within 1e6 mm of the origin, its quaternion of unit length");
    return X;
}

Pose poseOf(const json& object, const char* key) { return readPose(fieldOf(object, key), key); }

ordered_json toJson(const RecordedScene::Body& body) {
    return {{"name", body.name}, {"tree", body.tree}, {"surface", body.surface}, {"pose", toJson(body.X_WB)}};
}

RecordedScene::Body bodyOf(const json& object) {
    return {textOf(object, "name"), textOf(object, "tree"),
            object.contains("surface") ? textOf(object, "surface") : std::string(), poseOf(object, "pose")};
}

/// Every row has them as columns.
bool isColumn(std::string_view key) { return key == "stiffness" || key == "torsion" || key == "pause"; }

}  // namespace

const json& fieldOf(const json& object, const char* key) {
    if (!object.is_object() || !object.contains(key)) throw std::invalid_argument(std::string(key) + " is missing");
    return object.at(key);
}

std::string textOf(const json& object, const char* key) {
    const json& value = fieldOf(object, key);
    if (!value.is_string()) throw std::invalid_argument(std::string(key) + " must be a text");
    return value.get<std::string>();
}

std::uint64_t countOf(const json& object, const char* key) {
    const json& value = fieldOf(object, key);
    if (!value.is_number_unsigned()) throw std::invalid_argument(std::string(key) + " must be a whole number");
    return value.get<std::uint64_t>();
}

ordered_json toJson(const RecordedScene& scene) {
    ordered_json obstacles = ordered_json::array();
    for (const RecordedScene::Body& body : scene.obstacles) obstacles.push_back(toJson(body));
    return {
        {"file", scene.file.string()}, {"hash", scene.hash}, {"tool", toJson(scene.tool)}, {"obstacles", obstacles}};
}

RecordedScene toRecordedScene(const json& value) {
    RecordedScene scene{textOf(value, "file"), textOf(value, "hash"), bodyOf(fieldOf(value, "tool")), {}};
    const json& obstacles = fieldOf(value, "obstacles");
    if (!obstacles.is_array()) throw std::invalid_argument("obstacles must be a list");
    for (const json& body : obstacles) scene.obstacles.push_back(bodyOf(body));
    return scene;
}

ordered_json toJson(const TickStart& start, std::span<const Pose> X_WO) {
    ordered_json json = {{"tick", start.tick},
                         {"tool", toJson(start.X_WT)},
                         {"device", toJson(start.X_WT_device)},
                         {"loaded_before", start.loadedBefore}};
    for (const std::uint64_t id : start.touching.span()) json["touching"].push_back(id);
    for (const Pose& X : X_WO) json["obstacles"].push_back(toJson(X));
    return json;
}

TickStart toStart(const json& value) {
    const json& loaded = fieldOf(value, "loaded_before");
    if (!loaded.is_boolean()) throw std::invalid_argument("loaded_before must be true or false");
    TickStart start{countOf(value, "tick"), poseOf(value, "tool"), poseOf(value, "device"), loaded.get<bool>()};
    if (!value.contains("touching")) return start;  // nothing touched, or written before recordings had these pairs
    const json& ids = value["touching"];
    if (!ids.is_array()) throw std::invalid_argument("touching must be a list");
    for (const json& id : ids) {
        if (!id.is_number_unsigned()) throw std::invalid_argument("each of touching must be a whole number");
        start.touching.push(id.get<std::uint64_t>());
    }
    return start;
}

std::vector<Pose> toObstacles(const json& start) {
    std::vector<Pose> X_WO;
    if (!start.contains("obstacles")) return X_WO;  // written before recordings had moving obstacles
    const json& poses = start["obstacles"];
    if (!poses.is_array()) throw std::invalid_argument("obstacles must be a list");
    for (const json& pose : poses) X_WO.push_back(readPose(pose, "each of obstacles"));
    return X_WO;
}

ordered_json toJson(const Settings& settings, const Settings* before) {
    ordered_json object = ordered_json::object();
    for (const SettingInfo& info : settingTable()) {
        const std::string value = getSetting(settings, info.key);
        if (!before || (!isColumn(info.key) && value != getSetting(*before, info.key)))
            object[std::string(info.key)] = value;
    }
    return object;
}

void applySettings(Settings& settings, const json& values) {
    if (!values.is_object()) throw std::invalid_argument("settings must be an object");
    for (const auto& [key, value] : values.items()) {
        if (!value.is_string()) throw std::invalid_argument("settings." + key + " must be a text");
        if (settingKey(key).empty()) continue;  // Recording::programDifferences() names the version that had it
        const std::string wrong = setSetting(settings, key, value.get<std::string>());
        if (!wrong.empty()) throw std::invalid_argument("settings: " + wrong);
    }
    if (const std::string wrong = checkSettings(settings); !wrong.empty())
        throw std::invalid_argument("settings: " + wrong);
}

}  // namespace touchstone::sandbox
