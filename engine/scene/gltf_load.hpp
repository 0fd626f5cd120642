#pragma once
// The first half of reading glTF: from untrusted bytes on disk to a checked tinygltf model.
#include <tiny_gltf.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "engine/scene/gltf_check.hpp"

namespace touchstone::engine {

struct LoadedGltf {
    std::filesystem::path file;
    nlohmann::json document;  ///< as in the file, for content that the model lacks: extras, extensions
    tinygltf::Model model;    ///< checked: every index, buffer view and number is in range; holds the buffers' bytes
    std::size_t scene;        ///< index of the chosen scene
    UsedObjects used;

    /// Whether the scene uses an object. Unused objects are empty in `model` and unchecked in `document`.
    bool uses(std::string_view array, std::size_t index) const { return used.find(array)->second[index]; }
};

/// Reads a .gltf or .glb for one scene (-1: its default scene, else the first) with the buffers and images that it
/// uses. tinygltf only receives checked properties and opens no file. External files must be in the scene's folder or
/// below it. Throws SceneError.
LoadedGltf loadGltf(const std::filesystem::path& file, int scene, Warnings& warnings);

/// The files beside a .gltf or .glb that its buffers and images refer to and that exist, relative to its folder. Throws
/// SceneError if the file cannot be read.
std::vector<std::filesystem::path> externalFiles(const std::filesystem::path& file);

}  // namespace touchstone::engine
