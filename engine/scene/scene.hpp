#pragma once
// The scene as data: what a glTF file holds, and what the engine draws. Lengths in metres, as in glTF.
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/scene/animation.hpp"
#include "engine/scene/components.hpp"
#include "engine/scene/mesh_data.hpp"
#include "engine/scene/registry.hpp"

namespace touchstone::engine {

/// A file or scene that cannot be used; what() is one sentence naming the file, the object and the remedy.
struct SceneError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Every node is an entity with Name, LocalTransform, Hierarchy and WorldTransform; some have MeshInstance, Visibility
/// and NodeMarking.
struct Scene {
    Registry registry;
    std::string name;
    std::vector<Entity> roots;
    std::vector<Entity> nodes;         ///< by glTF node index; null where the node is not in this scene
    std::vector<MeshInstance> meshes;  ///< by glTF mesh index
    std::vector<Material> materials;
    std::vector<Image> images;
    std::vector<Animation> animations;  ///< channels on nodes outside this scene are left out
    JsonValue extras;                   ///< of the glTF scene object; null where it has none
    JsonValue extensions;               ///< of the file's root, e.g. KHR_physics_rigid_bodies; null where it has none
    std::vector<std::string> extensionsRequired;
    int index = 0;                      ///< glTF scene index
    std::filesystem::path file;         ///< where it was read from; empty for a new scene
    std::vector<std::string> warnings;  ///< one sentence each: what was left out of the file
};

/// Adds a node below `parent`, or a root when `parent` is null; its glTF index is `scene.nodes.size() - 1` afterwards.
Entity addNode(Scene& scene, std::string name, Entity parent = {}, const LocalTransform& local = {});

/// Adds a primitive to the node's mesh. Nodes that share the same data share one mesh in the written file.
void addMesh(Scene& scene, Entity node, std::shared_ptr<const MeshData> mesh, int material = -1);

/// Returns the material's index.
int addMaterial(Scene& scene, Material material);

/// Returns the image's index, for Material::texture.
int addImage(Scene& scene, Image image);

/// Replaces the `extras` of a node, and keeps its `extensions`.
void setExtras(Scene& scene, Entity node, nlohmann::json extras);

/// glTF index of a node, -1 when it has none.
int nodeIndex(const Scene& scene, Entity node);

/// Puts what the other scene shows below a new root of this name, and returns that. Geometry and looks come along;
/// markings and animations stay behind.
Entity appendScene(Scene& scene, const Scene& part, std::string name);

/// `node` is `ancestor` or hangs below it.
bool isBelow(const Registry& registry, Entity node, Entity ancestor);
/// Neither the node nor one above it is hidden.
bool isVisible(const Registry& registry, Entity node);

/// Text as a terminal, a log or a window may show it: control characters, marks that turn the direction of writing, and
/// bytes that are no UTF-8 become \n, \t, \x1b or \u202e. All of it stays on one line.
std::string escaped(const std::string& text);

/// Text of a file as a sentence may quote it: escaped, and shortened to 60 bytes.
std::string printable(const std::string& text);

/// `accessor 3` or `node 2 "tool"`, as sentences to the user name an object of a file.
std::string objectLabel(const std::string& kind, std::size_t index, const std::string& name = {});
std::string nodeLabel(const Scene& scene, Entity node);

}  // namespace touchstone::engine
