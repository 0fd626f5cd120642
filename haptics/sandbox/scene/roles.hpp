#pragma once
// The roles of a scene's nodes in the simulation: read from the file, changed in the window, saved again.
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/scene.hpp"
#include "haptics/loop/settings.hpp"
#include "haptics/math/rigid.hpp"
#include "haptics/sandbox/scene/gauge.hpp"
#include "haptics/sandbox/scene/role.hpp"

namespace touchstone::sandbox {

/// Where the tool node should come to rest, scene frame. The defaults accept any orientation.
struct GoalRegion {
    Pose X_WT;
    double tolerance = 1;         ///< mm between the origins
    double toleranceAngle = 3.2;  ///< rad
    double hold = 0;              ///< ms that the tool must stay in the region
    double depth = 0;             ///< mm along +y of X_WT, which points out, to where the insertion begins; 0: unknown
    int fold = 1;                 ///< number of equivalent orientations about that axis, evenly spaced

    double distance(const Pose& X_WO) const { return (X_WO.p - X_WT.p).norm(); }
    double angle(const Pose& X_WO) const;  ///< to the nearest equivalent orientation, rad
    bool contains(const Pose& X_WO) const { return distance(X_WO) <= tolerance && angle(X_WO) <= toleranceAngle; }
};

/// What assignRoles() found. `interpreted` and `warnings` are sentences for `touchstone validate`.
struct SceneRoles {
    engine::Entity tool;                    ///< null if no node is marked as the tool
    std::vector<engine::Entity> obstacles;  ///< in file order
    std::optional<GoalRegion> goal;
    std::optional<Gauge> gauge;
    std::optional<double> clearance;  ///< of the scene's fit, mm; its sphere trees and their settings follow from it
    engine::JsonValue outcome;        ///< expected outcome as written in the file; null without one
    std::vector<std::string> interpreted;  ///< how nodes were interpreted: node, role and reason
    std::vector<std::string> warnings;     ///< unknown keys, ignored candidates, unsupported features
};

/// Gives every marked node its Role (and BodyMarking, ColliderGeometry) and replaces those of an earlier call.
/// KHR_physics_rigid_bodies has priority: `motion` makes a node the tool, `collider` an obstacle if neither the node
/// nor an ancestor has a motion, `trigger` a goal. For other nodes `extras.touchstone.role` decides. Of several tools
/// the first in file order counts. Throws engine::SceneError naming file, node and field if a value has the wrong type
/// or range.
SceneRoles assignRoles(engine::Scene& scene);

/// Default settings, for spheres those of the scene's clearance, changed by the tool's stiffness and torsion and by the
/// scene's extras.touchstone.settings (the keys of settingTable()). Throws engine::SceneError with the sentence of
/// setSetting() or checkSettings().
Settings sceneSettings(const engine::Scene& scene, const SceneRoles& roles);

/// The node itself or its nearest ancestor that has a role; null if there is none.
engine::Entity roleOwner(const engine::Registry& registry, engine::Entity node);

/// Writes those settings into extras.touchstone of the scene that differ from what it sets already, except a pause.
void setSettings(engine::Scene& scene, const SceneRoles& roles, const Settings& settings);

}  // namespace touchstone::sandbox
