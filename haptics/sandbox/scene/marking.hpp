#pragma once
// Roles, sphere trees and friction that the user chooses, as edits of the nodes' extras and of physics materials.
#include <filesystem>
#include <optional>
#include <variant>
#include <vector>

#include "engine/edit/scene_edit.hpp"
#include "haptics/sandbox/scene/roles.hpp"

namespace touchstone::sandbox {

/// Nodes are named by their glTF index, as in engine::SceneEdit.
struct GiveRole {
    int node = -1;
    std::optional<Role> role;  ///< nothing: removes the role
    friend bool operator==(const GiveRole&, const GiveRole&) = default;
};
struct ChooseTree {
    int node = -1;
    TreeOptions tree;
    friend bool operator==(const ChooseTree&, const ChooseTree&) = default;
};
/// Sets the friction of the tool or of an obstacle where the part has it: in the physics material of its colliders,
/// which other parts may share, or in its extras if it has no collider. Colliders without a material get a new one.
struct ChooseFriction {
    int node = -1;
    std::optional<engine::FrictionMaterial> friction;  ///< changes the keys that have a value; nothing: removes all
    friend bool operator==(const ChooseFriction&, const ChooseFriction&) = default;
};
/// Adds the shapes of another glTF file as one body.
struct AddBody {
    std::filesystem::path file;
    Role role = Role::Obstacle;
    friend bool operator==(const AddBody&, const AddBody&) = default;
};
using Marking = std::variant<GiveRole, ChooseTree, ChooseFriction, AddBody>;

/// Appends the edits for the marking. `edits` are those of `scene`, some of which it may not contain yet: their extras
/// count. If another node becomes the tool, the old tool becomes visual. Throws engine::SceneError, without changing
/// anything, if KHR_physics_rigid_bodies sets the role.
void appendMarking(std::vector<engine::SceneEdit>& edits, const engine::Scene& scene, const Marking& marking);

/// Applies these edits to the scene itself; call assignRoles() afterwards.
void applyMarking(engine::Scene& scene, const Marking& marking);

/// True if moving the node does not change the shape of a body: no tool or obstacle above it contains it.
bool movesRigidly(const engine::Registry& registry, engine::Entity node);

}  // namespace touchstone::sandbox
