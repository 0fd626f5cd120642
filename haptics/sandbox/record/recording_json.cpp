#include "haptics/sandbox/record/recording_json.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "haptics/math/hash.hpp"
#include "haptics/sandbox/measure/report.hpp"

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
    return {{"name", body.name}, {"tree", body.tree}, {"pose", toJson(body.X_WB)}};
}

RecordedScene::Body bodyOf(const json& object) {
    return {textOf(object, "name"), textOf(object, "tree"), poseOf(object, "pose")};
}

std::string hashOf(const SphereTree& tree) {
    const TreeLevel& leaves = tree.levels.front();
    Hash hash;
    for (const auto* values : {&leaves.x, &leaves.y, &leaves.z, &leaves.r})
        hash.add(values->data(), sizeof(float) * static_cast<std::size_t>(leaves.count));
    return hexadecimal(hash.value());
}

bool standsInRows(std::string_view key) { return key == "stiffness" || key == "torsion" || key == "pause"; }

}  // namespace

std::string hashOf(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    if (!in) return {};
    const std::string bytes(std::istreambuf_iterator<char>(in), {});
    return hexadecimal(Hash().add(bytes.data(), bytes.size()).value());
}

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

ordered_json toJson(const StepStart& start, std::span<const Pose> X_WO) {
    ordered_json json = {{"tick", start.tick},
                         {"tool", toJson(start.X_WT)},
                         {"device", toJson(start.X_WT_device)},
                         {"loaded_before", start.loadedBefore}};
    for (const Pose& X : X_WO) json["obstacles"].push_back(toJson(X));
    return json;
}

StepStart toStart(const json& value) {
    const json& loaded = fieldOf(value, "loaded_before");
    if (!loaded.is_boolean()) throw std::invalid_argument("loaded_before must be true or false");
    return {countOf(value, "tick"), poseOf(value, "tool"), poseOf(value, "device"), loaded.get<bool>()};
}

std::vector<Pose> toObstacles(const json& start) {
    std::vector<Pose> X_WO;
    if (!start.contains("obstacles")) return X_WO;  // of a program that did not record their moves
    const json& poses = start["obstacles"];
    if (!poses.is_array()) throw std::invalid_argument("obstacles must be a list");
    for (const json& pose : poses) X_WO.push_back(readPose(pose, "each of obstacles"));
    return X_WO;
}

ordered_json toJson(const Settings& settings, const Settings* before) {
    ordered_json object = ordered_json::object();
    for (const SettingInfo& info : settingTable()) {
        const std::string value = getSetting(settings, info.key);
        if (!before || (!standsInRows(info.key) && value != getSetting(*before, info.key)))
            object[std::string(info.key)] = value;
    }
    return object;
}

void applySettings(Settings& settings, const json& values) {
    if (!values.is_object()) throw std::invalid_argument("settings must be an object");
    for (const auto& [key, value] : values.items()) {
        if (!value.is_string()) throw std::invalid_argument("settings." + key + " must be a text");
        const std::string wrong = setSetting(settings, key, value.get<std::string>());
        if (!wrong.empty()) throw std::invalid_argument("settings: " + wrong);
    }
    if (const std::string wrong = checkSettings(settings); !wrong.empty())
        throw std::invalid_argument("settings: " + wrong);
}

RecordedScene recordedScene(const std::filesystem::path& file, const World& world) {
    std::error_code error;
    RecordedScene scene;
    scene.file = file.empty() ? file : std::filesystem::absolute(file, error).lexically_normal();
    scene.hash = hashOf(file);
    scene.tool = {"tool", hashOf(*world.tool), world.X_WT_start};
    for (const Obstacle& obstacle : world.obstacles)
        scene.obstacles.push_back({obstacle.name, hashOf(*obstacle.tree), obstacle.X_WO});
    return scene;
}

std::shared_ptr<const World> recordedWorld(const RecordedScene& scene, const std::shared_ptr<const World>& now,
                                           std::string& why) {
    const auto other = [&](const std::string& body) { return "the sphere tree of " + body + " is another"; };
    World world = *now;
    if (hashOf(*world.tool) != scene.tool.tree)
        why = other("the tool");
    else if (world.obstacles.size() != scene.obstacles.size())
        why = "it had " + std::to_string(scene.obstacles.size()) + " obstacles and has " +
              std::to_string(world.obstacles.size());
    for (std::size_t i = 0; why.empty() && i < world.obstacles.size(); ++i) {
        if (hashOf(*world.obstacles[i].tree) != scene.obstacles[i].tree) why = other(world.obstacles[i].name);
        world.obstacles[i].X_WO = scene.obstacles[i].X_WB;
    }
    if (!why.empty()) return nullptr;
    world.X_WT_start = scene.tool.X_WB;
    return std::make_shared<const World>(std::move(world));
}

}  // namespace touchstone::sandbox
