#pragma once
// The dangerous half of reading glTF: from bytes on disk to a tinygltf model that is safe to walk.
#include <tiny_gltf.h>

#include <filesystem>
#include <nlohmann/json.hpp>

namespace touchstone::engine {

struct LoadedGltf {
    std::filesystem::path file;
    nlohmann::json document;  ///< as in the file, for what the model does not hold: extras, extensions
    tinygltf::Model model;    ///< checked: every index, buffer view and number is in range; holds the buffers' bytes
};

/// Reads a .gltf or .glb with all buffers, and the images that are base colours; other images stay empty. Checks come
/// before tinygltf sees anything: it is handed checked properties only, and opens no file. External files are read
/// from the scene's folder and below it alone. Throws SceneError.
LoadedGltf loadGltf(const std::filesystem::path& file);

}  // namespace touchstone::engine
