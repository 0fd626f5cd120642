#include "haptics/sandbox/session/goal_edit.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "engine/scene/transforms.hpp"
#include "haptics/loop/distances.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/sandbox/scene/baked_mesh.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {
namespace {

using engine::Entity;
using nlohmann::json;

std::size_t nearestObstacle(const HapticScene& scene, const Pose& X_WT, Geometry geometry) {
    std::size_t nearest = 0;
    if (scene.world->obstacles.size() < 2) return nearest;
    double least = 1e30;
    for (std::size_t k = 0; k < scene.world->obstacles.size(); ++k) {
        World one = *scene.world;
        one.obstacles = {scene.world->obstacles[k]};
        const Pose X_WO[]{obstaclePose(scene, k)};
        const double gap = trueClearance(one, X_WT, least, X_WO, geometry);
        if (gap >= least) continue;
        least = gap;
        nearest = k;
    }
    return nearest;
}

/// How far the tool at X_WT reaches into an obstacle along the goal's way out, mm; 0 or less if it does not.
double depthIn(const HapticScene& scene, std::size_t obstacle, const Pose& X_WT) {
    const Vec3 out = X_WT.q * Vec3::UnitY();
    const auto end = [&](Entity node, const Pose& X, double sign) {
        double most = -1e30;
        for (const Vec3& p : bakedTriangles(scene.scene, node).vertices) most = std::max(most, sign * out.dot(X * p));
        return sign * most;
    };
    return end(scene.roles.obstacles[obstacle], obstaclePose(scene, obstacle), 1) - end(scene.roles.tool, X_WT, -1);
}

/// The extras of the goal's node with another goal.
engine::AdjustExtras adjusted(const HapticScene& scene, const json& changes) {
    const Entity node = scene.roles.goalNode;
    const auto* marking = scene.scene.registry.find<engine::NodeMarking>(node);
    const json before = marking ? *marking->extras : json();
    json after = before.is_object() ? before : json::object();
    after["touchstone"]["goal"].update(changes);
    return {engine::nodeIndex(scene.scene, node), before, after};
}

json goalOf(const HapticScene& scene) {
    const auto* marking = scene.scene.registry.find<engine::NodeMarking>(scene.roles.goalNode);
    if (!marking || !marking->extras->is_object()) return json::object();
    return marking->extras->value("touchstone", json::object()).value("goal", json::object());
}

}  // namespace

std::vector<engine::SceneEdit> goalHere(const HapticScene& scene, const Pose& X_WT, Geometry geometry) {
    const engine::Registry& registry = scene.scene.registry;
    const std::size_t k = nearestObstacle(scene, X_WT, geometry);
    const Entity obstacle = scene.roles.obstacles[k];
    const Pose X_WO = toPose(engine::worldPose(registry, obstacle));
    const Pose& X_WO_now = obstaclePose(scene, k);
    const Pose X_WG = X_WO == X_WO_now ? X_WT : X_WO * X_WO_now.inverse() * X_WT;
    const engine::RigidPart wanted = toRigidPart(X_WG);

    const Entity node = scene.roles.goalNode;
    if (!node) {
        const glm::dmat4 X_OG = glm::inverse(engine::worldMatrix(registry, obstacle)) * engine::rigidMatrix(wanted);
        json extras;
        extras["touchstone"] = {{"role", name(Role::Goal)},
                                {"goal",
                                 {{"tolerance_m", toMeters(kNewGoalMm)},
                                  {"tolerance_rad", kNewGoalRad},
                                  {"hold_s", kNewGoalHoldMs / 1000}}}};
        if (const double depth = depthIn(scene, k, X_WT); depth > kNewGoalMm)
            extras["touchstone"]["goal"]["depth_m"] = toMeters(depth);
        return {engine::AddNode{engine::nodeIndex(scene.scene, obstacle), "goal", engine::localTransform(X_OG),
                                std::move(extras)}};
    }
    const json goal = goalOf(scene);
    if (node == scene.roles.tool || goal.contains("translation") || goal.contains("rotation")) {
        const glm::dvec3& t = wanted.translation;
        const glm::dquat& q = wanted.rotation;
        return {adjusted(scene, {{"translation", {t.x, t.y, t.z}}, {"rotation", {q.x, q.y, q.z, q.w}}})};
    }
    return {engine::PlaceNode{engine::nodeIndex(scene.scene, node), registry.get<engine::LocalTransform>(node),
                              engine::placedAt(registry, node, wanted)}};
}

engine::SceneEdit goalWith(const HapticScene& scene, const GoalRegion& goal) {
    json changes{{"tolerance_m", toMeters(goal.tolerance)},
                 {"tolerance_rad", goal.toleranceAngle},
                 {"hold_s", goal.hold / 1000}};
    if (goal.depth > 0 || goalOf(scene).contains("depth_m")) changes["depth_m"] = toMeters(goal.depth);
    return adjusted(scene, changes);
}

}  // namespace touchstone::sandbox
