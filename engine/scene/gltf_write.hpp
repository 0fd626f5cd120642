#pragma once
// glTF 2.0 out: a Scene into one self-contained file, and markings saved back into an existing file.
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "engine/scene/scene.hpp"

namespace touchstone::engine {

/// Writes the scene to a .glb, or to a .gltf with its buffer as data URI, after the extension of `file`. Images become
/// PNG. Node and mesh indices stay those of Scene::nodes and Scene::meshes. The file appears whole or not at all.
/// Throws SceneError when the scene is invalid or the file cannot be written.
void writeGltf(const Scene& scene, const std::filesystem::path& file);

/// The image as a PNG file; empty where it is too large for one. Pre: 4 bytes a pixel.
std::vector<std::uint8_t> pngBytes(const Image& image);

/// What to replace in an existing file, by glTF index: extras of nodes and scenes (a null value removes them), where
/// nodes stand and how they are called, and base colour, metalness and roughness of materials.
struct GltfUpdate {
    std::map<int, nlohmann::json> nodes;
    std::map<int, nlohmann::json> scenes;
    std::map<int, LocalTransform> places;
    std::map<int, std::string> names;
    std::map<int, Material> materials;
};

/// Copies `in` to `out` with only that replaced; the two may be the same file. Buffers stay byte for byte, the
/// rest of the JSON keeps its order and values. A .gltf with external files can only be saved into its own folder.
/// Throws SceneError; `out` is then untouched.
void updateGltf(const std::filesystem::path& in, const std::filesystem::path& out, const GltfUpdate& update);

}  // namespace touchstone::engine
