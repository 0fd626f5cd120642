#pragma once
// Where the bundled scenes are.
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

}  // namespace touchstone::app
