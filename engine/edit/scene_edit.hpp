#pragma once
// What was changed in a scene by hand, as data: applied in order to the scene as it was read. The last one is undone by
// leaving it out.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/scene/components.hpp"
#include "engine/scene/transforms.hpp"

namespace touchstone::engine {

/// Base colour (linear), metalness and roughness of a material, which textures multiply.
struct Looks {
    glm::vec4 baseColor{1};
    float metallic = 0, roughness = 0;
    friend bool operator==(const Looks&, const Looks&) = default;
};
Looks looksOf(const Material& material);

/// Nodes are named by their glTF index, which stays the same when a scene is read again.
struct SetExtras {
    int node = -1;
    nlohmann::json extras;  ///< in place of the node's extras; null removes them
    friend bool operator==(const SetExtras&, const SetExtras&) = default;
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
/// Another glTF file's shapes below a new node, which becomes the last one of the scene.
struct AddPart {
    std::filesystem::path file;
    nlohmann::json extras;  ///< of the new node
    friend bool operator==(const AddPart&, const AddPart&) = default;
};
using SceneEdit = std::variant<SetExtras, PlaceNode, PaintMaterial, RenameNode, AddPart>;

/// Appends an edit; one before it of the same kind and thing that says `from` and `to` is joined with it.
void append(std::vector<SceneEdit>& edits, SceneEdit edit);

/// Changes a scene. Edits of what is not there have no effect. Throws SceneError where a part
/// cannot be read or a role cannot be given. Updates world transforms.
void applyEdits(Scene& scene, const std::vector<SceneEdit>& edits);

/// What turns a scene with the edits `now` into one with `next`, if all in which the two differ says `from` and `to`.
std::optional<std::vector<SceneEdit>> reversibleChange(const std::vector<SceneEdit>& now,
                                                       const std::vector<SceneEdit>& next);

/// Local transform with which the rigid frame of a node stands at `wanted` (of which the rest is ignored); scale and
/// shear stay.
LocalTransform placedAt(const Registry& registry, Entity node, const RigidPart& wanted);

/// Writes what applyEdits() changed, and the scene's own extras, into a copy of the scene's file; everything else in it
/// stays. `out` may be that file. A scene with an added part is written as a new file. Throws SceneError when the scene
/// has no file or `out` cannot be written.
void saveScene(const Scene& scene, const std::filesystem::path& out);

}  // namespace touchstone::engine
