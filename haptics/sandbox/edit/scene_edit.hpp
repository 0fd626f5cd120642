#pragma once
// What was changed in a scene by hand, as data: applied in order to the scene as it was read. The last one is undone by
// leaving it out.
#include <filesystem>
#include <optional>
#include <variant>
#include <vector>

#include "engine/scene/components.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "haptics/sandbox/scene/roles.hpp"

namespace touchstone::sandbox {

/// Nodes are named by their glTF index, which stays when a scene is read again.
struct GiveRole {
    int node = -1;
    std::optional<Role> role;  ///< nothing takes it away
    friend bool operator==(const GiveRole&, const GiveRole&) = default;
};
struct ChooseTree {
    int node = -1;
    TreeOptions tree;
    friend bool operator==(const ChooseTree&, const ChooseTree&) = default;
};
struct PlaceNode {
    int node = -1;
    engine::LocalTransform from, to;  ///< in the parent's frame
    friend bool operator==(const PlaceNode&, const PlaceNode&) = default;
};
struct PaintMaterial {
    int material = -1;  ///< glTF index
    Looks from, to;
    friend bool operator==(const PaintMaterial&, const PaintMaterial&) = default;
};
struct RenameNode {
    int node = -1;
    std::string from, to;
    friend bool operator==(const RenameNode&, const RenameNode&) = default;
};
/// Another glTF file's shapes as a body of the scene, under a new node that is the last one then.
struct AddPart {
    std::filesystem::path file;
    Role role = Role::Obstacle;
    friend bool operator==(const AddPart&, const AddPart&) = default;
};
using SceneEdit = std::variant<GiveRole, ChooseTree, PlaceNode, PaintMaterial, RenameNode, AddPart>;

/// Appends an edit; one before it of the same kind and thing that says `from` and `to` is joined with it.
void append(std::vector<SceneEdit>& edits, SceneEdit edit);

/// Changes a scene. Edits of what is not there have no effect. Throws engine::SceneError where a part
/// cannot be read or a role cannot be given. Updates world transforms.
void applyEdits(engine::Scene& scene, const std::vector<SceneEdit>& edits);

/// What turns a scene with the edits `now` into one with `next`, if all in which the two differ says `from` and `to`.
std::optional<std::vector<SceneEdit>> reversibleChange(const std::vector<SceneEdit>& now,
                                                       const std::vector<SceneEdit>& next);

/// Local transform with which the node's rigid frame stands at X_WN (mm, scene frame); scale and shear stay.
engine::LocalTransform placedAt(const engine::Registry& registry, engine::Entity node, const Pose& X_WN);

/// The node can be moved without changing the shape of a body: it is no part of a tool or an obstacle above it.
bool movesRigidly(const engine::Registry& registry, engine::Entity node);

}  // namespace touchstone::sandbox
