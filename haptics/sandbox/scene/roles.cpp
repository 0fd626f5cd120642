#include "haptics/sandbox/scene/roles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "engine/scene/fields.hpp"
#include "engine/scene/gltf_container.hpp"
#include "engine/scene/rigid_bodies.hpp"
#include "engine/scene/text.hpp"
#include "engine/scene/transforms.hpp"
#include "haptics/builder/mesh_words.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/sandbox/scene/baked_mesh.hpp"
#include "haptics/sandbox/scene/flat_keys.hpp"
#include "haptics/sandbox/scene/friction.hpp"
#include "haptics/sandbox/scene/scene_motion.hpp"
#include "haptics/sandbox/scene/tree_words.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {
namespace {

using engine::Entity;
using engine::Registry;
using engine::Scene;
using nlohmann::json;

constexpr std::size_t kMaxWay = 1000;  // poses on the way to a goal
constexpr int kWaySamples = 1000;      // of a motion that is such a way
constexpr double kWayTolerance = 0.1;  // mm
constexpr double kTau = 2 * std::numbers::pi;

/// A role that a node could have, and the sentence that says why.
struct Candidate {
    Entity node;
    Role role;
    std::string why;
};

const json* touchstoneOf(const json& extras) {
    if (!extras.is_object()) return nullptr;
    const auto found = extras.find("touchstone");
    return found == extras.end() ? nullptr : &*found;
}

const json* touchstoneOf(const Scene& scene, Entity node) {
    const engine::NodeMarking* marking = scene.registry.find<engine::NodeMarking>(node);
    return marking ? touchstoneOf(*marking->extras) : nullptr;
}

bool hasMotion(const Scene& scene, Entity node) {
    std::vector<std::string> unused;
    const auto mark = engine::readRigidBody(scene, node, unused);
    return mark && mark->motion;
}

/// True if this node or an ancestor has a `motion`, so that the node moves with that body.
bool movesWithBody(const Scene& scene, Entity node) {
    while (node) {
        if (hasMotion(scene, node)) return true;
        const engine::Hierarchy* hierarchy = scene.registry.find<engine::Hierarchy>(node);
        node = hierarchy ? hierarchy->parent : Entity{};
    }
    return false;
}

class RoleReader {
  public:
    explicit RoleReader(Scene& scene) : scene_(scene) {}
    SceneRoles read();

  private:
    void readFit();
    void readNode(Entity node);
    void readMark(Entity node, engine::Fields& fields, std::optional<Role>& role);
    void chooseTool();
    void chooseGoal();
    void chooseGauge();
    void readGoal(engine::Fields& fields, Entity node, GoalRegion& goal) const;
    std::vector<Pose> readWay(engine::Fields& fields, Entity node, const GoalRegion& goal) const;
    std::vector<Pose> wayOfMotion(engine::Fields& fields, const std::string& name, const GoalRegion& goal) const;
    GoalRegion regionOf(Entity node);
    void readScene();
    void describeRoles();

    std::string label(Entity node) const { return nodeLabel(scene_, node); }
    template <class... Text>
    void warn(const Text&... text) {
        found_.warnings.push_back((std::string(text) + ...));
    }

    Scene& scene_;
    SceneRoles found_;
    TreeOptions tree_;  ///< of parts whose mark asks for no tree of its own
    std::vector<Candidate> candidates_;
};

/// Clearance below which no sphere tree follows a surface closely enough, mm: at 0.1 mm a splined hole needs 40,000
/// leaves and a minute.
constexpr double kClosestOfSpheres = 0.1;

/// The clearance of the scene's fit, from which its sphere trees follow.
void RoleReader::readFit() {
    const json* mark = touchstoneOf(*scene_.extras);
    if (!mark) return;
    engine::Fields fields(scene_, engine::objectLabel("scene", static_cast<std::size_t>(scene_.index)),
                          "extras.touchstone", *mark);
    found_.clearance = fields.number("clearance_mm", 1e-4, 100);
    if (!found_.clearance) return;
    if (*found_.clearance < kClosestOfSpheres) {
        tree_.leaves = 1024;  // for the view and for paper mode
    } else {
        tree_.maxError = 0.45 * *found_.clearance;
        tree_.quality = TreeQuality::Best;
    }
}

void RoleReader::readMark(Entity node, engine::Fields& fields, std::optional<Role>& role) {
    if (const auto known = fields.choice("role", kRoleNames)) role = static_cast<Role>(*known);
    BodyMarking body;
    const auto leaves = fields.whole("leaves", kMinLeaves, TreeOptions::kMaxLeaves);
    const auto error = fields.number("max_error_mm", kMinError, kMaxError);
    if (leaves && error) fields.fail("max_error_mm", "given without leaves, since their number follows from it");
    body.tree = leaves || error ? TreeOptions{} : tree_;
    body.tree.leaves = leaves.value_or(body.tree.leaves);
    body.tree.maxError = error.value_or(body.tree.maxError);
    const std::array geometries{geometryNames()[0].data(), geometryNames()[1].data()};
    if (const auto known = fields.choice("geometry", geometries))
        body.spheres = static_cast<Geometry>(*known) == Geometry::Spheres;
    if (const auto known = fields.choice("quality", kQualityNames))
        body.tree.quality = static_cast<TreeQuality>(*known);
    if (const auto known = fields.choice("interior", kInteriorNames))
        body.tree.interior = static_cast<Interior>(*known);
    // The file has N/m and N·m/rad, the settings N/mm and mN·m/rad; the ranges are those of the settings.
    if (const auto k = fields.number("stiffness_N_per_m", 1, 1e5)) body.stiffness = *k / 1000;
    if (const auto k = fields.number("torsion_Nm_per_rad", 1e-3, 1e3)) body.torsion = *k * 1000;
    if (const engine::FrictionMaterial friction = engine::readFriction(fields); !friction.empty())
        body.friction = {friction, -1};
    if (auto cad = fields.object("cad")) {
        body.cad.emplace();
        body.cad->deviation = cad->number("deviation_mm", 0, 1e3).value_or(0);
        body.cad->clearance = cad->number("clearance_mm", 0, 1e3);
        cad->warnUnknown(found_.warnings);
    }
    if (auto file = fields.object("file")) {
        body.file.emplace();
        body.file->unit = file->number("unit_m", 1e-6, 1e3).value_or(1);
        for (const auto& [key, pose] :
             {std::pair("in_scene", &body.file->X_WF), std::pair("in_node", &body.file->X_TF)})
            if (auto place = file->object(key)) {
                pose->p = toMm(place->vector("translation").value_or(glm::dvec3(0)));
                pose->q = toEigen(place->quaternion("rotation").value_or(glm::dquat(1, 0, 0, 0)));
                place->warnUnknown(found_.warnings);
            }
        file->warnUnknown(found_.warnings);
    }
    scene_.registry.add(node, body);
    // Their contents are read later, when tool and goal are known.
    for (const char* key : {"goal", "gauge", "outcome"}) fields.object(key);
    fields.warnUnknown(found_.warnings);
}

void RoleReader::readNode(Entity node) {
    std::optional<Role> marked;
    BodyMarking unmarked;
    unmarked.tree = tree_;
    scene_.registry.add(node, unmarked);
    if (const json* mark = touchstoneOf(scene_, node)) {
        engine::Fields fields(scene_, label(node), "extras.touchstone", *mark);
        readMark(node, fields, marked);
    }

    std::optional<Role> physical;
    std::string why;
    if (const auto body = engine::readRigidBody(scene_, node, found_.warnings)) {
        const bool moving = movesWithBody(scene_, node);
        if (body->collider) scene_.registry.add(node, *body->collider);
        if (body->motion) {
            physical = Role::Tool;
            why = "KHR_physics_rigid_bodies gives it a motion";
        } else if (body->collider && !moving) {
            physical = Role::Obstacle;
            why = "KHR_physics_rigid_bodies gives it a collider and no motion";
        } else if (body->trigger && !moving) {
            physical = Role::Goal;
            why = "KHR_physics_rigid_bodies makes it a trigger";
            scene_.registry.add(node, *body->triggerGeometry);
        }
    }
    if (physical && marked && *physical != *marked)
        warn(label(node), ": extras.touchstone.role says ", name(*marked), ", but ", why, ": its role is ",
             name(*physical));
    if (physical)
        candidates_.push_back({node, *physical, why});
    else if (marked)
        candidates_.push_back({node, *marked, "extras.touchstone.role says so"});
    else if (touchstoneOf(scene_, node))
        warn(label(node), ": extras.touchstone sets no role, so the rest of it has no effect");
}

void RoleReader::chooseTool() {
    for (Candidate& candidate : candidates_) {
        if (candidate.role != Role::Tool) continue;
        if (!found_.tool) {
            found_.tool = candidate.node;
            continue;
        }
        warn(label(candidate.node), " could also be the tool, but ", label(found_.tool),
             " comes first in the file: this node is only drawn");
        candidate.role = Role::Visual;
        candidate.why = "there is already a tool";
    }
}

/// The goal of the node's mark; without one, the node's own pose, with the size of its meshes as tolerance.
GoalRegion RoleReader::regionOf(Entity node) {
    GoalRegion region;
    region.X_WT = toPose(engine::worldPose(scene_.registry, node));
    // The meshes of a goal node are the region; those of the tool, which may have a goal too, are not.
    if (node != found_.tool) {
        const TriangleMesh shape = bakedTriangles(scene_, node);
        Eigen::AlignedBox3d box;
        for (const Vec3& vertex : shape.vertices) box.extend(vertex);
        if (!box.isEmpty() && box.sizes().maxCoeff() > 0) region.tolerance = box.sizes().maxCoeff() / 2;
    }
    const json* mark = touchstoneOf(scene_, node);
    if (!mark) return region;
    engine::Fields fields(scene_, label(node), "extras.touchstone", *mark);
    if (auto goal = fields.object("goal")) {
        readGoal(*goal, node, region);
        goal->warnUnknown(found_.warnings);
    }
    return region;
}

void RoleReader::readGoal(engine::Fields& fields, Entity node, GoalRegion& goal) const {
    if (const auto meters = fields.vector("translation")) goal.X_WT.p = toMm(*meters);
    if (const auto rotation = fields.quaternion("rotation")) goal.X_WT.q = toEigen(*rotation);
    if (const auto meters = fields.number("tolerance_m", 0, 1e3)) goal.tolerance = *meters * kMmPerMeter;
    if (const auto angle = fields.number("tolerance_rad", 0, kTau)) goal.toleranceAngle = *angle;
    if (const auto seconds = fields.number("hold_s", 0, 1e6)) goal.hold = *seconds * 1000;
    if (const auto meters = fields.number("depth_m", 0, 1e3)) goal.depth = *meters * kMmPerMeter;
    if (const auto times = fields.whole("fold", 0, 1000)) goal.fold = *times;
    if (const auto meters = fields.number("lead_m", -1, 1)) goal.lead = *meters * kMmPerMeter;
    goal.way = readWay(fields, node, goal);
    if (goal.lead != 0 && !goal.way.empty()) fields.fail("lead_m", "given without way, which says how the tool turns");
}

std::vector<Pose> RoleReader::readWay(engine::Fields& fields, Entity node, const GoalRegion& goal) const {
    const json* value = fields.find("way");
    if (!value) return {};
    if (value->is_string()) return wayOfMotion(fields, value->get<std::string>(), goal);
    if (!value->is_array() || value->empty() || value->size() > kMaxWay)
        fields.fail("way", "the name of a motion that leads out, or a list of 1 to " + std::to_string(kMaxWay) +
                               " poses in the frame of the goal");
    std::vector<Pose> way;
    for (const json& item : *value) {
        const std::string path = "extras.touchstone.goal.way[" + std::to_string(way.size()) + "]";
        engine::Fields pose(scene_, label(node), path, item);
        const auto meters = pose.vector("translation");
        if (!meters) pose.fail("translation", "three numbers, in meters");
        const auto rotation = pose.quaternion("rotation");
        way.push_back({toMm(*meters), rotation ? toEigen(*rotation) : Quat(Quat::Identity())});
    }
    return way;
}

/// The motion backward, as the fewest poses that follow it within a tenth of a millimeter.
std::vector<Pose> RoleReader::wayOfMotion(engine::Fields& fields, const std::string& name,
                                          const GoalRegion& goal) const {
    for (const engine::Animation& animation : scene_.animations) {
        if (animation.name != name || !found_.tool || !movesTool(animation, found_.tool)) continue;
        const SceneMotion motion(scene_, animation, found_.tool);
        const Pose start = motion.at(0);
        if (goal.distance(start) > std::max(1.0, goal.tolerance) ||
            goal.angle(start) > std::max(0.1, goal.toleranceAngle))
            fields.fail("way", "the name of a motion that begins at the goal: '" + engine::escaped(name) + "' begins " +
                                   std::to_string(std::lround(goal.distance(start))) + " mm from it");
        std::vector<Pose> path;
        for (int i = kWaySamples; i > 0; --i)
            path.push_back(goal.X_WT.inverse() * motion.at(motion.duration() * i / kWaySamples));
        return simplified(path, kWayTolerance);
    }
    fields.fail("way", "the name of one of the tool's motions: there is no motion '" + engine::escaped(name) + "'");
}

void RoleReader::chooseGoal() {
    const auto hasGoal = [&](Entity node) {
        const json* mark = node ? touchstoneOf(scene_, node) : nullptr;
        return mark && mark->contains("goal");
    };
    Entity chosen = hasGoal(found_.tool) ? found_.tool : Entity{};
    for (const Candidate& candidate : candidates_) {
        if (candidate.role != Role::Goal) {
            if (candidate.node != found_.tool && hasGoal(candidate.node))
                warn(label(candidate.node),
                     ": a goal belongs to the tool or to a node with the role goal: this one has no effect");
        } else if (chosen) {
            warn(label(candidate.node), " is also a goal, but ", label(chosen), " comes first: this one has no effect");
        } else {
            chosen = candidate.node;
        }
    }
    if (!chosen) return;
    found_.goalNode = chosen;
    found_.goal = regionOf(chosen);
}

void RoleReader::chooseGauge() {
    for (const Candidate& candidate : candidates_) {
        const json* mark = touchstoneOf(scene_, candidate.node);
        const bool marked = mark && mark->contains("gauge");
        if (candidate.role != Role::Gauge) {
            if (marked)
                warn(label(candidate.node), ": a gauge belongs to a node with the role gauge: this one has no effect");
            continue;
        }
        if (found_.gauge) {
            warn(label(candidate.node), " is also a gauge, but ", found_.gauge->name,
                 " comes first: this one has no effect");
            continue;
        }
        const std::string& given = scene_.registry.get<engine::Name>(candidate.node).value;
        found_.gauge = {.name = given.empty() ? label(candidate.node) : engine::printable(given),
                        .X_WG = toPose(engine::worldPose(scene_.registry, candidate.node))};
        if (!marked) continue;
        engine::Fields gauge(scene_, label(candidate.node), "extras.touchstone.gauge", mark->at("gauge"));
        if (const auto meters = gauge.vector("tip_m")) found_.gauge->p_TP = toMm(*meters);
        gauge.warnUnknown(found_.warnings);
    }
}

/// Reads the mark of the glTF scene itself.
void RoleReader::readScene() {
    const std::string object = engine::objectLabel("scene", static_cast<std::size_t>(scene_.index));
    if (const json* mark = touchstoneOf(*scene_.extras)) {
        engine::Fields fields(scene_, object, "extras.touchstone", *mark);
        fields.object("settings");
        fields.find("clearance_mm");
        fields.text("description");
        if (fields.object("outcome")) found_.outcome = mark->at("outcome");
        fields.warnUnknown(found_.warnings);
    }
    const json* mark = found_.tool ? touchstoneOf(scene_, found_.tool) : nullptr;
    if (mark && mark->contains("outcome")) found_.outcome = mark->at("outcome");
}

void RoleReader::describeRoles() {
    for (const Candidate& candidate : candidates_) {
        const BodyMarking* body = scene_.registry.find<BodyMarking>(candidate.node);
        std::string article = candidate.role == Role::Tool ? "the " : candidate.role == Role::Visual ? "" : "an ";
        if (candidate.role == Role::Goal || candidate.role == Role::Gauge) article = "a ";
        found_.interpreted.push_back(
            label(candidate.node) + " is " + article + name(candidate.role) +
            (body ? " (" + words(body->tree) + (body->spheres ? ", touched by it" : "") + ")" : "") + ": " +
            candidate.why);
        if (candidate.role == Role::Obstacle && (body->stiffness || body->torsion))
            warn(label(candidate.node), ": only the tool has a stiffness: that of an obstacle has no effect");
    }
}

SceneRoles RoleReader::read() {
    readFit();
    for (const Entity node : scene_.nodes)
        if (node) readNode(node);
    chooseTool();
    for (const Candidate& candidate : candidates_) {
        scene_.registry.add(candidate.node, candidate.role);
        if (candidate.role == Role::Obstacle) found_.obstacles.push_back(candidate.node);
    }
    for (const Entity node : scene_.nodes) {
        const Role* role = scene_.registry.find<Role>(node);
        if (!role || (*role != Role::Tool && *role != Role::Obstacle)) scene_.registry.remove<BodyMarking>(node);
    }
    for (const Entity obstacle : found_.obstacles)
        if (found_.tool &&
            roleOwner(scene_.registry, scene_.registry.get<engine::Hierarchy>(obstacle).parent) == found_.tool)
            warn(label(obstacle), " is below the tool: obstacles do not move with it, so it stays where it is");
    chooseGoal();
    chooseGauge();
    readScene();
    describeRoles();
    std::vector<Entity> parts = found_.obstacles;
    if (found_.tool) parts.insert(parts.begin(), found_.tool);
    assignFriction(scene_, parts, found_.interpreted, found_.warnings);
    return std::move(found_);
}

}  // namespace

SceneRoles assignRoles(Scene& scene) {
    for (const Entity node : scene.nodes) {
        scene.registry.remove<Role>(node);
        scene.registry.remove<BodyMarking>(node);
        scene.registry.remove<engine::ColliderGeometry>(node);
    }
    nestFlatKeys(scene);
    return RoleReader(scene).read();
}

Settings sceneSettings(const Scene& scene, const SceneRoles& roles) {
    Settings settings;
    if (roles.clearance && *roles.clearance >= kClosestOfSpheres) {
        settings.margin = settings.trust = std::min(settings.margin, 0.4 * *roles.clearance);
        settings.slack = std::min(0.1, 0.6 * *roles.clearance);
    }
    if (roles.tool) {
        const BodyMarking& body = scene.registry.get<BodyMarking>(roles.tool);
        settings.stiffness = body.stiffness.value_or(settings.stiffness);
        settings.torsion = body.torsion.value_or(settings.torsion);
    }
    const json* mark = touchstoneOf(*scene.extras);
    if (!mark || !mark->contains("settings")) return settings;
    const std::string object = engine::objectLabel("scene", static_cast<std::size_t>(scene.index));
    const auto fail = [&](const std::string& sentence) {
        engine::failIn(scene.file, object, "extras.touchstone.settings: " + sentence);
    };
    for (const auto& [key, value] : mark->at("settings").items()) {
        if (!value.is_primitive() || value.is_null()) fail(key + " must be a number, a text, true or false");
        const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
        if (const std::string wrong = setSetting(settings, key, text); !wrong.empty()) fail(wrong);
    }
    if (const std::string wrong = checkSettings(settings); !wrong.empty()) fail(wrong);
    return settings;
}

void setSettings(Scene& scene, const SceneRoles& roles, const Settings& settings) {
    const Settings now = sceneSettings(scene, roles);
    json changed = json::object();
    for (const SettingInfo& info : settingTable()) {
        const std::string key(info.key), value = getSetting(settings, key);
        if (key == "pause" || value == getSetting(now, key)) continue;
        const json number = json::parse(value, nullptr, false);
        changed[key] = number.is_number() ? number : json(value);
    }
    if (changed.empty()) return;
    if (!scene.extras->is_null() && !scene.extras->is_object())
        engine::failIn(scene.file, engine::objectLabel("scene", static_cast<std::size_t>(scene.index)),
                       "its extras are not a JSON object: make them one to store settings there");
    json& stored = (*scene.extras)["touchstone"]["settings"];
    for (const EarlierKey& key : earlierSettingKeys())
        if (changed.contains(key.now)) stored.erase(std::string(key.earlier));
    stored.update(changed);
}

}  // namespace touchstone::sandbox
