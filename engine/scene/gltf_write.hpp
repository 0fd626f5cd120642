#pragma once
// Writes a Scene as one self-contained glTF 2.0 file, and saves changes into an existing file.
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "engine/scene/scene.hpp"

namespace touchstone::engine {

/// Writes the scene to a .glb, or to a .gltf with its buffer as data URI, depending on the extension of `file`. Images
/// are stored as PNG. Node and mesh indices are those of Scene::nodes and Scene::meshes. The file is written completely
/// or not at all. Throws SceneError if the scene is invalid or the file cannot be written.
void writeGltf(const Scene& scene, const std::filesystem::path& file);

/// The image as a PNG file; empty if it is too large for one. Pre: 4 bytes per pixel.
std::vector<std::uint8_t> pngBytes(const Image& image);

/// Linear channels of the translation and rotation of `node`; the other channels of the animation stay as they are in
/// the file.
struct MotionUpdate {
    int node = -1;
    Animation animation;
};

/// Changes to an existing file, by glTF index: extras of nodes and scenes (a null value removes them), local transforms
/// and names of nodes, base color, metalness and roughness of materials, the KHR_physics_rigid_bodies of nodes and, as
/// -1, of the root, motions by the index of their animation, which may be the next one, and added nodes with the index
/// of their parent (-1: roots; nodes that the file has already are not added again).
struct GltfUpdate {
    std::map<int, nlohmann::json> nodes;
    std::map<int, nlohmann::json> scenes;
    std::map<int, LocalTransform> places;
    std::map<int, std::string> names;
    std::map<int, Material> materials;
    std::map<int, nlohmann::json> rigidBodies = {};
    std::map<int, MotionUpdate> motions = {};
    std::map<int, int> addedNodes = {};
    int scene = 0;  ///< that gets the added roots
};

/// Copies `in` to `out` with only these changes; the two may be the same file. Buffers are copied byte for byte; the
/// keys of a motion become a buffer of their own in the JSON, which a later update of that motion replaces; and
/// the rest of the JSON keeps its order and values. A .gltf with external files can only be saved into its own folder.
/// Throws SceneError and leaves `out` unchanged on failure.
void updateGltf(const std::filesystem::path& in, const std::filesystem::path& out, const GltfUpdate& update);

}  // namespace touchstone::engine
