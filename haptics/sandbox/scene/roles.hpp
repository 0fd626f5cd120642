#pragma once
// What the nodes of a scene are to the hand: read from the file, chosen in the window, saved back.
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/scene.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "haptics/loop/settings.hpp"
#include "haptics/math/rigid.hpp"
#include "haptics/sandbox/scene/gauge.hpp"

namespace touchstone::sandbox {

/// Component of nodes that have a role. Everything below such a node belongs to it, up to nodes with a role of their
/// own.
enum class Role : std::uint8_t {
    Tool,      ///< moves with the hand; exactly one
    Obstacle,  ///< fixed
    Goal,      ///< where the tool is to come to rest
    Visual,    ///< drawn only
    Gauge,     ///< reads how deep the tool reaches
};
const char* name(Role role);

/// What a scene may ask of a sphere tree: least leaves, and the range of its protrusion in mm.
inline constexpr int kMinLeaves = 8;
inline constexpr double kMinError = 1e-6, kMaxError = 1e3;

/// Component of the tool and of obstacles.
struct BodyMarking {
    TreeOptions tree;
    std::optional<double> stiffness, torsion;  ///< of the tool: N/mm, mN·m/rad
};

/// Where the tool node is to come to rest, scene frame. The defaults accept any orientation.
struct GoalRegion {
    Pose X_WT;
    double tolerance = 1;         ///< mm between the origins
    double toleranceAngle = 3.2;  ///< rad
    double hold = 0;              ///< ms that the tool has to stay
    double depth = 0;             ///< mm along +y of X_WT, the way out, where the way in begins; 0: not known
    int fold = 1;                 ///< orientations about that axis that are as good, evenly spread

    double distance(const Pose& X_WO) const { return (X_WO.p - X_WT.p).norm(); }
    double angle(const Pose& X_WO) const;  ///< to the nearest of them, rad
    bool contains(const Pose& X_WO) const { return distance(X_WO) <= tolerance && angle(X_WO) <= toleranceAngle; }
};

/// What assignRoles() found. `taken` and `warnings` are sentences for `touchstone validate`.
struct SceneRoles {
    engine::Entity tool;                    ///< null when no node is marked
    std::vector<engine::Entity> obstacles;  ///< in file order
    std::optional<GoalRegion> goal;
    std::optional<Gauge> gauge;
    nlohmann::json outcome;             ///< expected outcome as it stands in the file; null without one
    std::vector<std::string> taken;     ///< node, role and why
    std::vector<std::string> warnings;  ///< unknown keys, candidates passed over, what is not supported
};

/// Gives every marked node its Role (and BodyMarking, ColliderGeometry), replacing those of an earlier call.
/// KHR_physics_rigid_bodies comes first: `motion` makes a tool, `collider` without motion on itself or above an
/// obstacle, `trigger` a goal; elsewhere `extras.touchstone.role` decides. Of several tools the first in file order is
/// taken. Throws engine::SceneError naming file, node and field when a value has the wrong type or range.
SceneRoles assignRoles(engine::Scene& scene);

/// Default settings, changed by the tool's stiffness and torsion and by the scene's extras.touchstone.settings (the
/// keys of settingTable()). Throws engine::SceneError with the sentence of setSetting() or checkSettings().
Settings sceneSettings(const engine::Scene& scene, const SceneRoles& roles);

/// The node itself or its nearest ancestor with a role; null without one.
engine::Entity roleOwner(const engine::Registry& registry, engine::Entity node);

/// Asks in extras.touchstone of the scene for those settings that are not already as given; not for a pause.
void setSettings(engine::Scene& scene, const SceneRoles& roles, const Settings& settings);

}  // namespace touchstone::sandbox
