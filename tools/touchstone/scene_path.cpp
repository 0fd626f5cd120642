#include "tools/touchstone/scene_path.hpp"

#include <algorithm>
#include <stdexcept>

#include "haptics/math/nearest_name.hpp"
#include "haptics/sandbox/record/recording.hpp"

namespace touchstone::app {

namespace fs = std::filesystem;

fs::path sceneFolder() { return sandbox::bundledScenes(); }

std::vector<fs::path> listScenes() {
    std::vector<fs::path> scenes;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(sceneFolder(), error)) {
        const fs::path extension = entry.path().extension();
        if (extension == ".glb" || extension == ".gltf") scenes.push_back(entry.path());
    }
    std::sort(scenes.begin(), scenes.end());
    return scenes;
}

fs::path findScene(const std::string& pathOrName) {
    std::error_code error;
    const fs::path path = pathOrName;
    // A bundled scene takes precedence over a folder of its name. Reading another folder or a pipe reports what it is.
    if (fs::is_regular_file(path, error)) return path;
    std::string names;
    std::vector<std::string> all;
    for (const fs::path& scene : listScenes()) {
        if (scene.filename() == pathOrName || scene.stem() == pathOrName) return scene;
        names += (names.empty() ? "" : ", ") + scene.stem().string();
        all.push_back(scene.stem().string());
    }
    if (fs::exists(path, error)) return path;
    if (const std::string nearest = nearestName(pathOrName, all); !nearest.empty())
        throw std::runtime_error("there is no scene '" + pathOrName + "': did you mean '" + nearest + "'?");
    throw std::runtime_error("there is no scene '" + pathOrName + "': give the path of a .glb or .gltf file" +
                             (names.empty() ? "" : ", or one of " + names));
}

fs::path sceneOfRecording(const fs::path& recording, const fs::path& named, const std::string& advice) {
    return sandbox::findRecordedScene(sandbox::Recording(recording).scene(), recording, named, advice);
}

}  // namespace touchstone::app
