#pragma once
// Roles and sphere trees chosen by hand, as edits of the nodes' extras.
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
    std::optional<Role> role;  ///< nothing removes it
    friend bool operator==(const GiveRole&, const GiveRole&) = default;
};
struct ChooseTree {
    int node = -1;
    TreeOptions tree;
    friend bool operator==(const ChooseTree&, const ChooseTree&) = default;
};
/// Another glTF file's shapes as one body.
struct AddBody {
    std::filesystem::path file;
    Role role = Role::Obstacle;
    friend bool operator==(const AddBody&, const AddBody&) = default;
};
using Marking = std::variant<GiveRole, ChooseTree, AddBody>;

/// Appends the edits that make the marking. `edits` are those of `scene` that it may not show yet: extras in them
/// count. A new tool takes the role of the old one, which becomes visual. Throws engine::SceneError where
/// KHR_physics_rigid_bodies sets the role, and then changes nothing.
void appendMarking(std::vector<engine::SceneEdit>& edits, const engine::Scene& scene, const Marking& marking);

/// The same on the scene itself; call assignRoles() afterwards.
void applyMarking(engine::Scene& scene, const Marking& marking);

/// The node can be moved without changing the shape of a body: it is not a part of a tool or an obstacle above it.
bool movesRigidly(const engine::Registry& registry, engine::Entity node);

}  // namespace touchstone::sandbox
