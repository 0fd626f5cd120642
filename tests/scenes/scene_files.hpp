#pragma once
// The scenes of the build.
#include <algorithm>
#include <filesystem>
#include <vector>

#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::test {

inline std::vector<std::filesystem::path> sceneFiles() {
    std::vector<std::filesystem::path> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(TOUCHSTONE_BINARY_DIR "/scenes", error))
        if (entry.path().extension() == ".glb" || entry.path().extension() == ".gltf") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

/// Opens one of them, with its trees from the build: those that its settings touch, or all.
inline sandbox::HapticScene openBundled(const std::filesystem::path& file, bool allTrees = false) {
    return sandbox::openScene(file,
                              {.treeCache = TOUCHSTONE_BINARY_DIR "/trees", .progress = {}, .allTrees = allTrees});
}

}  // namespace touchstone::test
