#include "tools/touchstone/new_scene.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "engine/scene/gltf_read.hpp"
#include "engine/scene/mesh_file.hpp"
#include "engine/scene/transforms.hpp"
#include "haptics/builder/mesh_repair.hpp"
#include "haptics/sandbox/scene/roles.hpp"
#include "haptics/sandbox/scene/tree_words.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::app {
namespace {

using engine::Entity;
using engine::Scene;

constexpr double kClearance = 0.1;           ///< of the tool's size: how far outside it starts
constexpr double kTolerance = 0.01;          ///< of the tool's size: how near to its goal it counts as seated
constexpr double kLargestTolerance = 0.001;  ///< m
constexpr double kFarScene = 10;             ///< m: floats resolve 1 µm there
constexpr double kToleranceAngle = 0.05;     ///< rad
constexpr double kPlay = 1.2;                ///< of the turn that a thread leaves the tool: its goal's tolerance
constexpr double kTurnsPerSecond = 2, kKeysPerTurn = 16;      ///< of a demonstration on a thread
constexpr double kOutside = 0.5, kMoving = 3, kSeated = 1.5;  ///< s: pieces of the demonstration

/// All triangles that are visible, in the frame of the scene, m.
TriangleMesh shownTriangles(const Scene& scene) {
    TriangleMesh shown;
    for (const Entity node : scene.nodes) {
        const auto* instance = node ? scene.registry.find<engine::MeshInstance>(node) : nullptr;
        if (!instance || !isVisible(scene.registry, node)) continue;
        const glm::dmat4 matrix = engine::worldMatrix(scene.registry, node);
        for (const engine::Primitive& primitive : instance->primitives) {
            const auto base = std::uint32_t(shown.vertices.size());
            for (const glm::vec3& position : primitive.mesh->positions) {
                const glm::dvec4 p = matrix * glm::dvec4(position, 1);
                shown.vertices.emplace_back(p.x, p.y, p.z);
            }
            const auto& indices = primitive.mesh->indices;
            for (std::size_t i = 0; i + 2 < indices.size(); i += 3)
                shown.triangles.push_back({base + indices[i], base + indices[i + 1], base + indices[i + 2]});
        }
    }
    return shown;
}

/// Writes the options that were given, and leaves the others to the defaults.
void markTree(nlohmann::json& mark, const TreeChoice& choice, double diagonal) {
    const TreeOptions options = withChoice({}, choice, diagonal);
    if (options.maxError > 0) {
        if (options.maxError < sandbox::kMinError || options.maxError > sandbox::kMaxError)
            throw UsageError("--max-error is outside the range that scenes allow");
        mark["max_error_mm"] = options.maxError;
    }
    if (choice.leaves) mark["leaves"] = options.leaves;
    if (choice.quality) mark["quality"] = *choice.quality;
    if (choice.interior) mark["interior"] = *choice.interior;
}

nlohmann::json placed(const engine::RigidPart& pose) {
    const glm::dvec3& p = pose.translation;
    const glm::dquat& q = pose.rotation;
    return {{"translation", {p.x, p.y, p.z}}, {"rotation", {q.x, q.y, q.z, q.w}}};
}

/// Adds a part below a node with this role at `pose`; `origin` is that node's frame in the coordinates of the part.
Entity addPart(Scene& scene, const Part& part, sandbox::Role role, const NewScene& parts, const engine::RigidPart& pose,
               const engine::RigidPart& origin) {
    nlohmann::json mark{{"role", sandbox::name(role)}};
    if (part.deviation) mark["cad"] = {{"deviation_mm", *part.deviation * sandbox::kMmPerMeter}};
    if (role == sandbox::Role::Tool && parts.clearance > 0)
        mark["cad"]["clearance_mm"] = parts.clearance * sandbox::kMmPerMeter;
    if (role == sandbox::Role::Tool) {
        const glm::dquat back = glm::conjugate(origin.rotation);
        const engine::RigidPart inNode =
            chained(part.modeled, {.translation = -(back * origin.translation), .rotation = back});
        mark["file"] = {{"unit_m", part.unit}, {"in_scene", placed(part.inScene)}, {"in_node", placed(inNode)}};
    }
    markTree(mark, parts.tree, glm::length(part.high - part.low) * sandbox::kMmPerMeter);
    const Entity node = appendScene(scene, part.content, part.name);
    engine::LocalTransform& own = scene.registry.get<engine::LocalTransform>(node);
    own.translation = pose.translation;
    own.rotation = pose.rotation;
    for (const Entity child : scene.registry.get<engine::Hierarchy>(node).children) {
        engine::LocalTransform& local = scene.registry.get<engine::LocalTransform>(child);
        const glm::dquat back = glm::conjugate(origin.rotation);
        local.translation = back * (local.translation - origin.translation);
        local.rotation = back * local.rotation;
    }
    setExtras(scene, node, {{"touchstone", std::move(mark)}});
    return node;
}

/// Bounds along the axis.
struct Span {
    double low = 1e30, high = -1e30;
};
Span span(const Part& part, const glm::dvec3& axis) {
    const double a = glm::dot(part.low, axis), b = glm::dot(part.high, axis);
    const glm::dvec3 size = glm::abs(axis);
    if (std::max({size.x, size.y, size.z}) == 1) return {std::min(a, b), std::max(a, b)};
    Span found;
    for (const Vec3& v : shownTriangles(part.content).vertices) {
        const double at = glm::dot(glm::dvec3(v.x(), v.y(), v.z()), axis);
        found = {std::min(found.low, at), std::max(found.high, at)};
    }
    return found;
}

/// On the axis of the portion of the tool that is no higher than `top`, at its lowest point: the center of that
/// portion's box across the axis.
glm::dvec3 originOf(const Part& tool, const glm::dvec3& axis, double bottom, double top) {
    glm::dvec3 low(1e30), high(-1e30);
    const double rounding = 1e-9 * glm::length(tool.high - tool.low);
    for (const Vec3& v : shownTriangles(tool.content).vertices) {
        const glm::dvec3 p(v.x(), v.y(), v.z());
        const bool within = glm::all(glm::greaterThanEqual(p, tool.low - rounding)) &&
                            glm::all(glm::lessThanEqual(p, tool.high + rounding));
        if (glm::dot(p, axis) > top || !within) continue;
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    const glm::dvec3 center = (low + high) / 2.0;
    return center + (bottom - glm::dot(center, axis)) * axis;
}

void addGoal(Scene& scene, const NewGoal& goal, double depth, double size, const engine::RigidPart& pose) {
    const double tolerance = goal.tolerance.value_or(std::min(kLargestTolerance, kTolerance * size));
    nlohmann::json region{{"depth_m", depth},
                          {"tolerance_m", tolerance},
                          {"tolerance_rad", std::max(kToleranceAngle, kPlay * goal.play)},
                          {"hold_s", 0.5}};
    if (goal.lead != 0) region["lead_m"] = goal.lead;
    if (goal.fold != 1) region["fold"] = goal.fold;
    const Entity node = addNode(scene, "goal", {}, {.translation = pose.translation, .rotation = pose.rotation});
    setExtras(scene, node,
              {{"touchstone", {{"role", sandbox::name(sandbox::Role::Goal)}, {"goal", std::move(region)}}}});
}

/// The same on a thread: the tool turns all the way, also outside. Between two keys it keeps to the thread, since it
/// moves along a line and turns about it.
engine::Animation screwed(Entity tool, const std::function<engine::RigidPart(double)>& at, double travel, double lead) {
    engine::AnimationChannel path, turning;
    path.target = turning.target = tool;
    turning.path = engine::AnimationPath::Rotation;
    const auto key = [&](double seconds, double left) {
        const engine::RigidPart pose = at(left);
        const glm::dquat& q = pose.rotation;
        path.times.push_back(seconds);
        path.values.emplace_back(pose.translation, 0);
        turning.times.push_back(seconds);
        turning.values.emplace_back(q.x, q.y, q.z, q.w);
    };
    const double turns = travel / std::abs(lead), moving = std::max(kMoving, turns / kTurnsPerSecond);
    const int keys = int(std::ceil(kKeysPerTurn * turns));
    key(0, travel);
    for (int i = 0; i <= keys; ++i) {
        const double t = double(i) / keys;
        key(kOutside + moving * t, travel * (1 - t * t * (3 - 2 * t)));  // starting and stopping gently
    }
    key(kOutside + moving + kSeated, 0);
    return {"demonstration", {std::move(path), std::move(turning)}};
}

/// From outside to the goal, starting and stopping gently.
engine::Animation demonstration(Entity tool, const glm::dvec3& start, const glm::dvec3& goal) {
    engine::AnimationChannel path;
    path.target = tool;
    path.interpolation = engine::Interpolation::CubicSpline;
    double seconds = 0;
    for (const auto& [duration, place] :
         {std::pair(0.0, start), std::pair(kOutside, start), std::pair(kMoving, goal), std::pair(kSeated, goal)}) {
        path.times.push_back(seconds += duration);
        for (const glm::dvec4& value : {glm::dvec4(0), glm::dvec4(place, 0), glm::dvec4(0)})  // tangents beside it
            path.values.push_back(value);
    }
    return {"demonstration", {std::move(path)}};
}

}  // namespace

void findBox(Part& part, const std::string& file, bool zUp, const PlaceUnit& unit, const engine::RigidPart& pose) {
    TriangleMesh shown = shownTriangles(part.content);
    if (shown.triangles.empty())
        throw engine::SceneError(file + ": shows no triangles; export the part with its mesh visible");
    part.low = glm::dvec3(1e30);
    part.high = glm::dvec3(-1e30);
    const auto add = [&](const Vec3& p) {
        part.low = glm::min(part.low, glm::dvec3(p.x(), p.y(), p.z()));
        part.high = glm::max(part.high, glm::dvec3(p.x(), p.y(), p.z()));
    };
    for (const Vec3& p : shown.vertices) add(p);
    const glm::dvec3 middle = (part.low + part.high) / 2.0;
    const Vec3 base(middle.x, middle.y, middle.z);
    for (Vec3& p : shown.vertices) p = (p - base) * sandbox::kMmPerMeter;
    try {
        RepairedMesh body = repairMesh(shown);
        const auto inFile = [&](Vec3& place) {
            place += sandbox::kMmPerMeter * base;
            if (zUp) place = {place.x(), 0 - place.z(), place.y()};
            const glm::dvec3 own = glm::inverse(pose.rotation) * (glm::dvec3(place.x(), place.y(), place.z()) -
                                                                  sandbox::kMmPerMeter * pose.translation);
            place = {own.x, own.y, own.z};
        };
        for (std::vector<MeshPatch>* patches : {&body.closedHoles, &body.loose})
            for (MeshPatch& patch : *patches) inFile(patch.place);
        if (!body.loose.empty() || !body.closedHoles.empty())
            part.notes.push_back(file + ": was repaired: " + words(body, unit));
        part.open = !body.closed();
        if (part.open) {
            MeshDefects defects = defectsOf(body);
            inFile(defects.largest.place);
            part.notes.push_back(
                file + " has " + words(defects, unit) +
                ": it is touched by its spheres, and its fit cannot be measured, until you close it in "
                "the program that made it");
        }
        if (body.loose.empty()) return;
        part.low = glm::dvec3(1e30);
        part.high = glm::dvec3(-1e30);
        for (const Triangle& t : body.cover)
            for (const Vec3& p : t) {
                const Vec3 inScene = p / (body.scale * sandbox::kMmPerMeter) + base;
                add(inScene);
            }
    } catch (const std::invalid_argument&) {
        // A mesh that cannot be repaired is named when the scene is opened.
    }
}

engine::RigidPart chained(const engine::RigidPart& first, const engine::RigidPart& then) {
    engine::RigidPart both;
    both.rotation = then.rotation * first.rotation;
    both.translation = then.translation + then.rotation * first.translation;
    return both;
}

Part readPart(const std::filesystem::path& file, const PartFrame& frame, const engine::Material& material,
              const engine::RigidPart& pose) {
    Part part;
    part.name = file.stem().string();
    if (engine::isMeshFile(file)) {
        engine::MeshFile read = engine::readMeshFile(file, frame.meters);
        part.notes = std::move(read.notes);
        engine::MeshData mesh = engine::splitAtCreases(read.mesh, frame.crease);
        if (pose.rotation != glm::dquat(1, 0, 0, 0))
            for (std::vector<glm::vec3>* vectors : {&mesh.positions, &mesh.normals})
                for (glm::vec3& v : *vectors) v = glm::vec3(pose.rotation * glm::dvec3(v));
        read.origin = pose.translation + pose.rotation * read.origin;
        if (frame.zUp)
            for (std::vector<glm::vec3>* vectors : {&mesh.positions, &mesh.normals})
                for (glm::vec3& v : *vectors) v = {v.x, v.z, 0 - v.y};
        const Entity node = addNode(part.content, part.name);
        const glm::dvec3& o = read.origin;
        part.origin = frame.zUp ? glm::dvec3(o.x, o.z, 0 - o.y) : o;
        part.content.registry.get<engine::LocalTransform>(node).translation = part.origin;
        addMesh(part.content, node, std::make_shared<const engine::MeshData>(std::move(mesh)),
                addMaterial(part.content, material));
    } else {
        part.content = engine::readGltf(file);
        for (const std::string& warning : part.content.warnings) part.notes.push_back(warning);
        for (const Entity root : part.content.roots) {
            auto& local = part.content.registry.get<engine::LocalTransform>(root);
            local.translation = pose.translation + pose.rotation * local.translation;
            local.rotation = pose.rotation * local.rotation;
        }
    }
    engine::updateWorldTransforms(part.content);
    const bool isMesh = engine::isMeshFile(file);
    part.unit = isMesh ? frame.meters : 1;
    if (isMesh && frame.zUp) part.inScene.rotation = kZUp;
    part.modeled = chained(pose, part.inScene);
    findBox(part, file.string(), frame.zUp && isMesh,
            isMesh ? PlaceUnit{frame.unit, frame.meters * sandbox::kMmPerMeter} : PlaceUnit{"m", sandbox::kMmPerMeter},
            pose);
    return part;
}

glm::dvec3 moveToOrigin(NewScene& parts) {
    const Part& first = parts.obstacles.front();
    const glm::dvec3 middle = (first.low + first.high) / 2.0;
    if (glm::length(middle) <= kFarScene) return glm::dvec3(0);
    const glm::dvec3 by = glm::dvec3(0) - glm::round(middle * sandbox::kMmPerMeter) / sandbox::kMmPerMeter;
    const auto move = [&](Part& part) {
        for (const Entity root : part.content.roots)
            part.content.registry.get<engine::LocalTransform>(root).translation += by;
        for (glm::dvec3* point :
             {&part.low, &part.high, &part.origin, &part.inScene.translation, &part.modeled.translation})
            *point += by;
        engine::updateWorldTransforms(part.content);
    };
    move(parts.tool);
    for (Part& obstacle : parts.obstacles) move(obstacle);
    if (parts.onAxis) *parts.onAxis += by;
    return by;
}

engine::Scene makeScene(const NewScene& parts, std::vector<std::string>& warnings) {
    const glm::dvec3& axis = parts.axis;
    if (parts.demonstration && !parts.goal)
        throw UsageError("--demo needs a goal to lead to: give --goal DEPTH, or --assembled");
    // The extent of the obstacles and the lowest point of the tool, along the way out.
    double top = -1e30, under = 1e30;
    for (const Part& obstacle : parts.obstacles) {
        const Span along = span(obstacle, axis);
        top = std::max(top, along.high);
        under = std::min(under, along.low);
    }
    const double bottom = span(parts.tool, axis).low, size = glm::length(parts.tool.high - parts.tool.low);
    const double modeled = top - bottom;

    // `goal` and `start` are travels of the tool along the axis from where it is modeled.
    const double start = modeled + kClearance * size;
    double depth = 0, goal = 0;
    engine::RigidPart origin{.translation = parts.tool.origin};
    if (parts.goal) {
        if (!parts.goal->depth && !parts.assembled)
            throw UsageError("--goal needs a depth, unless the parts are modeled --assembled");
        depth = parts.goal->depth.value_or(modeled);
        if (!parts.assembled) goal = modeled - depth;
        if (!(modeled > 0) && parts.assembled)
            throw UsageError("with --assembled the tool reaches into the obstacles along the way out, but it lies " +
                             std::to_string(std::lround(-modeled * 1000)) +
                             " mm outside: name the way out with --axis, or leave --assembled out");
        if (depth > top - under + size) {
            char text[160];
            std::snprintf(text, sizeof text,
                          "at the goal the tool is %.4g mm below the top of obstacles that are %.4g mm high: check "
                          "--goal, --unit and --axis",
                          depth * sandbox::kMmPerMeter, (top - under) * sandbox::kMmPerMeter);
            warnings.emplace_back(text);
        }
        origin.translation = parts.onAxis ? *parts.onAxis + (bottom - glm::dot(*parts.onAxis, axis)) * axis
                                          : originOf(parts.tool, axis, bottom, parts.assembled ? top : bottom + depth);
        origin.rotation = glm::dquat(glm::dvec3(0, 1, 0), axis);
    }
    // The pose of the tool at a travel; on a thread it turns as it travels.
    const double lead = parts.goal ? parts.goal->lead : 0, turn = parts.goal ? parts.goal->turn : 0;
    const auto at = [&](double travel) {
        engine::RigidPart pose = origin;
        pose.translation += travel * axis;
        const double turned = turn + (lead != 0 ? 2 * std::numbers::pi * (travel - goal) / lead : 0);
        pose.rotation = pose.rotation * glm::angleAxis(turned, glm::dvec3(0, 1, 0));
        return pose;
    };

    Scene scene;
    scene.name = parts.name;
    const Entity tool = addPart(scene, parts.tool, sandbox::Role::Tool, parts, at(start), origin);
    for (const Part& obstacle : parts.obstacles) {
        const engine::RigidPart own{.translation = obstacle.origin};
        addPart(scene, obstacle, sandbox::Role::Obstacle, parts, own, own);
    }
    if (parts.goal) addGoal(scene, *parts.goal, depth, size, at(goal));
    // A demonstration from the start to the goal, where the tool must be seated.
    if (parts.demonstration) {
        nlohmann::json extras = *scene.registry.get<engine::NodeMarking>(tool).extras;
        extras["touchstone"]["outcome"] = {{"seated", true}, {"max_penetration_mm", 0.001}};
        setExtras(scene, tool, std::move(extras));
        scene.animations.push_back(lead != 0
                                       ? screwed(
                                             tool, [&](double left) { return at(goal + left); }, start - goal, lead)
                                       : demonstration(tool, at(start).translation, at(goal).translation));
    }
    return scene;
}

}  // namespace touchstone::app
