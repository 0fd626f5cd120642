#pragma once
// The roles of a scene's nodes in the simulation: read from the file, changed in the window, saved again.
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/scene.hpp"
#include "haptics/device/goal.hpp"
#include "haptics/loop/settings.hpp"
#include "haptics/math/rigid.hpp"
#include "haptics/sandbox/scene/gauge.hpp"
#include "haptics/sandbox/scene/role.hpp"

namespace touchstone::sandbox {

/// What assignRoles() found. `interpreted` and `warnings` are sentences for `touchstone validate`.
struct SceneRoles {
    engine::Entity tool;                    ///< null if no node is marked as the tool
    std::vector<engine::Entity> obstacles;  ///< in file order
    std::optional<GoalRegion> goal;
    engine::Entity goalNode;  ///< the node with the goal, which may be the tool; null without a goal
    std::optional<Gauge> gauge;
    std::optional<double> clearance;  ///< of the scene's fit, mm; its sphere trees and their settings follow from it
    engine::JsonValue outcome;        ///< expected outcome as written in the file; null without one
    std::vector<std::string> interpreted;  ///< how nodes were interpreted: node, role and reason
    std::vector<std::string> warnings;     ///< unknown keys, ignored candidates, unsupported features
};

/// Gives every marked node its Role (and BodyMarking, ColliderGeometry) and replaces those of an earlier call.
/// KHR_physics_rigid_bodies has priority: `motion` makes a node the tool, `collider` an obstacle if neither the node
/// nor an ancestor has a motion, `trigger` a goal. For other nodes `extras.touchstone.role` decides. The first of
/// several tools in file order counts. Throws engine::SceneError naming file, node and field if a value has the wrong
/// type or range.
SceneRoles assignRoles(engine::Scene& scene);

/// Default settings, for spheres those of the scene's clearance, changed by the tool's stiffness and torsion and by the
/// scene's extras.touchstone.settings (the keys of settingTable()). Throws engine::SceneError with the sentence of
/// setSetting() or checkSettings().
Settings sceneSettings(const engine::Scene& scene, const SceneRoles& roles);

/// Writes the settings that differ from those of the scene into its extras.touchstone. Leaves out whether it is paused.
void setSettings(engine::Scene& scene, const SceneRoles& roles, const Settings& settings);

}  // namespace touchstone::sandbox
