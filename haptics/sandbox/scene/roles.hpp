#pragma once
// What the nodes of a scene are to the hand: read from the file, chosen in the window, saved back.
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/scene.hpp"
#include "haptics/loop/settings.hpp"
#include "haptics/math/rigid.hpp"
#include "haptics/sandbox/scene/gauge.hpp"
#include "haptics/sandbox/scene/role.hpp"

namespace touchstone::sandbox {

/// Component of nodes that came from another file.
struct AddedPart {};

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
    engine::JsonValue outcome;          ///< expected outcome as it stands in the file; null without one
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

/// Marks a node in extras.touchstone, or removes the mark; call assignRoles() afterwards. A new tool takes the role of
/// the old one, which becomes visual. Throws engine::SceneError where KHR_physics_rigid_bodies fixes the role.
void setRole(engine::Scene& scene, engine::Entity node, std::optional<Role> role);

/// Asks for a sphere tree in extras.touchstone of a node; likewise.
void setTree(engine::Scene& scene, engine::Entity node, const TreeOptions& tree);

/// Puts a node elsewhere in its parent's frame. Call engine::updateWorldTransforms() afterwards.
void setPlace(engine::Scene& scene, engine::Entity node, const engine::LocalTransform& local);

/// Base colour (linear), metalness and roughness of a material, which textures multiply.
struct Looks {
    glm::vec4 baseColor{1};
    float metallic = 0, roughness = 0;
    friend bool operator==(const Looks&, const Looks&) = default;
};
Looks looksOf(const engine::Material& material);

/// Changes a material by its index, and the name of a node.
void setLooks(engine::Scene& scene, int material, const Looks& looks);
void setName(engine::Scene& scene, engine::Entity node, const std::string& name);

/// Asks in extras.touchstone of the scene for those settings that are not already as given; not for a pause.
void setSettings(engine::Scene& scene, const SceneRoles& roles, const Settings& settings);

/// Writes what the functions above changed into a copy of the scene's file, all else as it stands; `out` may be that
/// file. A scene with an AddedPart is written anew. Throws engine::SceneError when the scene has no file or `out`
/// cannot be written.
void saveScene(const engine::Scene& scene, const std::filesystem::path& out);

}  // namespace touchstone::sandbox
