#pragma once
// Where the bundled scenes and those of recordings are.
#include <filesystem>
#include <string>
#include <vector>

namespace touchstone::app {

/// The bundled scenes: in share/touchstone of an installed program, else in `scenes` beside the executable.
std::filesystem::path sceneFolder();

/// The .glb and .gltf files of that folder, sorted; empty when there is no such folder.
std::vector<std::filesystem::path> listScenes();

/// The path of a file, or of a scene in sceneFolder() by its name. Throws std::runtime_error that lists the scenes.
std::filesystem::path findScene(const std::string& pathOrName);

/// Where the scene of a recording is now. `named`: what --scene names, or empty. Throws std::runtime_error with one
/// sentence that ends with `advice` if it is not found.
std::filesystem::path sceneOfRecording(const std::filesystem::path& recording, const std::filesystem::path& named,
                                       const std::string& advice =
                                           "put it beside the recording, or name it with "
                                           "--scene");

}  // namespace touchstone::app
