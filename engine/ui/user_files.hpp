#pragma once
// Files in the user's configuration folder that the window keeps between runs.
#include <filesystem>
#include <vector>

namespace touchstone::engine {

/// $TOUCHSTONE_CONFIG, else $XDG_CONFIG_HOME/touchstone, else ~/.config/touchstone; empty when none of them is set.
std::filesystem::path configFolder();

/// Recent scenes, newest first, one path per line in `FOLDER/recent`. With an empty folder name they are kept in memory
/// only. Read and write errors are ignored.
class RecentScenes {
  public:
    static constexpr std::size_t kMost = 12;

    explicit RecentScenes(std::filesystem::path folder = {});
    /// Recent scenes; those whose file was missing at construction are left out.
    const std::vector<std::filesystem::path>& list() const { return scenes_; }
    void add(const std::filesystem::path& scene);

  private:
    std::filesystem::path folder_;
    std::vector<std::filesystem::path> scenes_;
};

/// The folder that was browsed last, as keepFolder() stored it in `FOLDER/browsed`; without one that in which
/// the program was started, or the user's home if that is the root.
std::filesystem::path browsedFolder(const std::filesystem::path& config);
/// Write errors are ignored.
void keepFolder(const std::filesystem::path& config, const std::filesystem::path& browsed);

/// The .glb and .gltf files in these folders, sorted. Missing folders are ignored.
std::vector<std::filesystem::path> findScenes(const std::vector<std::filesystem::path>& folders);

}  // namespace touchstone::engine
