#pragma once
// The user's changes of a scene, as data. They are applied in order to the scene as read; dropping the last one undoes
// it.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/scene/animation.hpp"
#include "engine/scene/components.hpp"
#include "engine/scene/transforms.hpp"

namespace touchstone::engine {

/// Base color (linear), metalness and roughness of a material, which textures multiply.
struct Looks {
    glm::vec4 baseColor{1};
    float metallic = 0, roughness = 0;
    friend bool operator==(const Looks&, const Looks&) = default;
};
Looks looksOf(const Material& material);

/// Nodes are named by their glTF index, which stays the same when a scene is read again.
struct SetExtras {
    int node = -1;     ///< -1: the glTF scene itself
    JsonValue extras;  ///< in place of its extras; null removes them
    friend bool operator==(const SetExtras&, const SetExtras&) = default;
};
/// Changes extras that neither a shape nor a role depends on, such as the tolerance of a goal.
struct AdjustExtras {
    int node = -1;
    JsonValue from, to;
    friend bool operator==(const AdjustExtras&, const AdjustExtras&) = default;
};
struct SetRigidBody {
    int node = -1;   ///< -1: the file's root, which has the physics materials
    JsonValue body;  ///< in place of its KHR_physics_rigid_bodies
    friend bool operator==(const SetRigidBody&, const SetRigidBody&) = default;
};
struct PlaceNode {
    int node = -1;
    LocalTransform from, to;  ///< in the parent's frame
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
/// Adds the shapes of another glTF file below a new last node.
struct AddPart {
    std::filesystem::path file;
    JsonValue extras;  ///< of the new node
    friend bool operator==(const AddPart&, const AddPart&) = default;
};
/// Adds a last node without a mesh.
struct AddNode {
    int parent = -1;  ///< -1: none
    std::string name;
    LocalTransform local;
    JsonValue extras;
    friend bool operator==(const AddNode&, const AddNode&) = default;
};
/// Replaces the translation and rotation of a node in the first animation that has one, or adds an animation with them.
/// Null: as in the file. The channels of the given animation have no target; its name and extras have no effect.
struct SetMotion {
    int node = -1;
    std::shared_ptr<const Animation> from, to;
    friend bool operator==(const SetMotion&, const SetMotion&) = default;
};
using SceneEdit = std::variant<SetExtras, AdjustExtras, SetRigidBody, PlaceNode, PaintMaterial, RenameNode, AddPart,
                               AddNode, SetMotion>;

/// Appends an edit. Merges it with an earlier one of the same kind and object if both have `from` and `to`.
void append(std::vector<SceneEdit>& edits, SceneEdit edit);

/// Applies the edits. An edit of a missing object has no effect. Throws SceneError where a part
/// cannot be read or a role cannot be given. Updates world transforms.
void applyEdits(Scene& scene, const std::vector<SceneEdit>& edits);

/// The edits that turn a scene with `now` into one with `next`; nothing if they differ in an edit without `from` and
/// `to`, except that `next` may add nodes.
std::optional<std::vector<SceneEdit>> reversibleChange(const std::vector<SceneEdit>& now,
                                                       const std::vector<SceneEdit>& next);

/// The local transform that gives the node this rigid world pose; scale and shear stay, and the rest of `wanted` is
/// ignored.
LocalTransform placedAt(const Registry& registry, Entity node, const RigidPart& wanted);

/// Writes what applyEdits() changed, and the scene's own extras, into a copy of the scene's file; everything else in it
/// stays. `out` may be that file. A scene with an added part is written as a new file. Throws SceneError when the scene
/// has no file or `out` cannot be written.
void saveScene(const Scene& scene, const std::filesystem::path& out);

}  // namespace touchstone::engine
