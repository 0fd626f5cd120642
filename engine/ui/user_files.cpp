#include "engine/ui/user_files.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string>

#include "engine/scene/folders.hpp"
#include "engine/scene/gltf_container.hpp"

namespace touchstone::engine {

namespace fs = std::filesystem;

fs::path configFolder() { return userFolder("TOUCHSTONE_CONFIG", "XDG_CONFIG_HOME", ".config"); }

RecentScenes::RecentScenes(fs::path folder) : folder_(std::move(folder)) {
    if (folder_.empty()) return;
    std::ifstream in(folder_ / "recent");
    std::error_code error;
    for (std::string line; scenes_.size() < kMost && std::getline(in, line);)
        if (fs::is_regular_file(line, error)) scenes_.emplace_back(line);
}

void RecentScenes::add(const fs::path& scene) {
    std::error_code error;
    fs::path whole = fs::absolute(scene, error).lexically_normal();
    if (error || (!scenes_.empty() && scenes_.front() == whole)) return;
    std::erase(scenes_, whole);
    scenes_.insert(scenes_.begin(), std::move(whole));
    if (scenes_.size() > kMost) scenes_.resize(kMost);
    if (folder_.empty()) return;
    fs::create_directories(folder_, error);
    std::string text;
    for (const fs::path& each : scenes_)
        if (each.string().find('\n') == std::string::npos) text += each.string() + '\n';
    try {
        writeBytes(folder_ / "recent", {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
    } catch (const SceneError&) {
        // The list is only a convenience, so a failure to store it is ignored.
    }
}

fs::path browsedFolder(const fs::path& config) {
    std::string line;
    std::error_code error;
    if (!config.empty()) {
        std::ifstream in(config / "browsed");
        std::getline(in, line);
    }
    if (!line.empty() && fs::is_directory(line, error)) return line;
    // Where the program was started; a desktop's menu starts it at the root.
    const fs::path here = fs::current_path(error);
    const char* home = std::getenv("HOME");
    return home && (error || here == here.root_path()) ? fs::path(home) : here;
}

void keepFolder(const fs::path& config, const fs::path& browsed) {
    const std::string text = browsed.string() + '\n';
    if (config.empty() || browsed.string().find('\n') != std::string::npos) return;
    std::error_code error;
    fs::create_directories(config, error);
    try {
        writeBytes(config / "browsed", {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
    } catch (const SceneError&) {
        // Only a convenience, like the recent scenes.
    }
}

std::vector<std::filesystem::path> findScenes(const std::vector<std::filesystem::path>& folders) {
    std::vector<std::filesystem::path> scenes;
    for (const std::filesystem::path& folder : folders) {
        std::error_code ignored;
        for (const auto& entry : std::filesystem::directory_iterator(folder, ignored))
            if (const auto extension = entry.path().extension(); extension == ".glb" || extension == ".gltf")
                scenes.push_back(entry.path());
    }
    std::sort(scenes.begin(), scenes.end());
    return scenes;
}

}  // namespace touchstone::engine
