#pragma once
// The scene as data: the content of a glTF file, which the engine draws. Lengths in meters, as in glTF.
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

/// Error of an unusable file or scene; what() is one sentence naming the file, the object and the remedy.
struct SceneError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Every node is an entity with Name, LocalTransform, Hierarchy and WorldTransform; some have MeshInstance, Visibility
/// and NodeMarking.
struct Scene {
    Registry registry;
    std::string name;
    std::vector<Entity> roots;
    std::vector<Entity> nodes;         ///< by glTF node index; null for nodes outside this scene
    std::vector<MeshInstance> meshes;  ///< by glTF mesh index
    std::vector<Material> materials;
    std::vector<Image> images;
    std::vector<Animation> animations;  ///< without channels on nodes outside this scene
    JsonValue extras;                   ///< of the glTF scene object; null if it has none
    JsonValue extensions;               ///< of the file's root, e.g. KHR_physics_rigid_bodies; null if it has none
    std::vector<std::string> extensionsRequired;
    int index = 0;                      ///< glTF scene index
    std::filesystem::path file;         ///< file that was read; empty for a new scene
    std::vector<std::string> warnings;  ///< one sentence each: content of the file that was ignored
};

/// Adds a node below `parent`, or a root when `parent` is null; its glTF index is `scene.nodes.size() - 1` afterwards.
Entity addNode(Scene& scene, std::string name, Entity parent = {}, const LocalTransform& local = {});

/// Adds a primitive to the node's mesh. Nodes with the same data share a mesh in the written file.
void addMesh(Scene& scene, Entity node, std::shared_ptr<const MeshData> mesh, int material = -1);

/// Returns the material's index.
int addMaterial(Scene& scene, Material material);

/// Returns the image's index, for Material::texture.
int addImage(Scene& scene, Image image);

/// Replaces the `extras` of a node and keeps its `extensions`.
void setExtras(Scene& scene, Entity node, nlohmann::json extras);

/// glTF index of a node; -1 if it has none.
int nodeIndex(const Scene& scene, Entity node);

/// Copies the visible nodes of another scene below a new root with this name, and returns the root. Geometry, materials
/// and images are copied; markings and animations are not.
Entity appendScene(Scene& scene, const Scene& part, std::string name);

/// Whether `node` is `ancestor` or a descendant of it.
bool isBelow(const Registry& registry, Entity node, Entity ancestor);
/// Whether neither the node nor any of its ancestors is hidden.
bool isVisible(const Registry& registry, Entity node);

/// Text that is safe to show in a terminal, a log or a window: control characters, marks of writing direction and
/// invalid UTF-8 bytes are escaped as \n, \t, \x1b or \u202e. The result is one line.
std::string escaped(const std::string& text);

/// Text of a file as quoted in messages: escaped, and shortened to 60 bytes.
std::string printable(const std::string& text);

/// Name of an object of a file in messages: `accessor 3` or `node 2 "tool"`.
std::string objectLabel(const std::string& kind, std::size_t index, const std::string& name = {});
std::string nodeLabel(const Scene& scene, Entity node);

}  // namespace touchstone::engine
