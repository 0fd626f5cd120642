#pragma once
// Where scenes and the program itself stand.
#include <filesystem>
#include <string>
#include <vector>

namespace touchstone::app {

/// `scenes` beside the executable.
std::filesystem::path sceneFolder();

/// The .glb and .gltf files of that folder, sorted; none when there is no such folder.
std::vector<std::filesystem::path> listScenes();

/// A path to a file, or the bare name of a scene in sceneFolder(). Throws std::runtime_error listing what is there.
std::filesystem::path findScene(const std::string& pathOrName);

}  // namespace touchstone::app
