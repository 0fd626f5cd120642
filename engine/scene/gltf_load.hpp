#pragma once
// The dangerous half of reading glTF: from bytes on disk to a tinygltf model that is safe to walk.
#include <tiny_gltf.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_check.hpp"

namespace touchstone::engine {

struct LoadedGltf {
    std::filesystem::path file;
    nlohmann::json document;  ///< as in the file, for what the model does not hold: extras, extensions
    tinygltf::Model model;    ///< checked: every index, buffer view and number is in range; holds the buffers' bytes
    std::size_t scene;        ///< index of the chosen scene
    UsedObjects used;

    /// The scene uses this object; others are empty in `model`, and may be anything in `document`.
    bool uses(std::string_view array, std::size_t index) const { return used.find(array)->second[index]; }
};

/// Reads a .gltf or .glb for one scene (-1: its default scene, else the first) with the buffers and images that this
/// uses. Checks come before tinygltf sees anything: it is handed checked properties only, and opens no file. External
/// files are read from the scene's folder and below it alone. Throws SceneError.
LoadedGltf loadGltf(const std::filesystem::path& file, int scene, Warnings& warnings);

}  // namespace touchstone::engine
