#pragma once
// What the window remembers between runs, in the user's configuration folder.
#include <filesystem>
#include <vector>

namespace touchstone::engine {

/// $TOUCHSTONE_CONFIG, else $XDG_CONFIG_HOME/touchstone, else ~/.config/touchstone; empty when none of them is set.
std::filesystem::path configFolder();

/// Scenes opened last, newest first, one path a line in `FOLDER/recent`. An empty folder keeps them in memory only;
/// what cannot be read or written is as if it were empty.
class RecentScenes {
  public:
    static constexpr std::size_t kMost = 12;

    explicit RecentScenes(std::filesystem::path folder = {});
    /// Those that still exist.
    const std::vector<std::filesystem::path>& list() const { return scenes_; }
    void add(const std::filesystem::path& scene);

  private:
    std::filesystem::path folder_;
    std::vector<std::filesystem::path> scenes_;
};

/// The .glb and .gltf files in these folders, sorted; what is no folder has none.
std::vector<std::filesystem::path> findScenes(const std::vector<std::filesystem::path>& folders);

}  // namespace touchstone::engine
