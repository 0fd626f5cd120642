#pragma once
// Reads a scene and builds its trees on its own thread.
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "engine/edit/scene_edit.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// A scene or STEP file, the edits made in the window, and the settings of the run (nothing: the scene's).
struct SceneRequest {
    std::filesystem::path file;
    std::vector<engine::SceneEdit> edits = {};
    std::optional<Settings> settings = {};
    bool allTrees = false;  ///< see SceneOptions
};

/// Progress of opening a scene, until it is shown.
struct OpeningProgress {
    std::string file;
    std::string part;          ///< part whose tree is being built; empty while the file is read and at the end
    double fraction = 0;       ///< of all parts, 0 to 1
    double secondsLeft = -1;   ///< estimate for this part; negative while there is none
    std::string reading = {};  ///< what is done with a STEP file; empty when that is over
};

/// Begins in its constructor; its destructor cancels it and waits for the thread.
class SceneOpening {
  public:
    /// `adjust`: turns the scene's settings into those of the run, if the request has none.
    SceneOpening(SceneRequest request, const std::filesystem::path& treeCache,
                 std::function<Settings(const Settings&)> adjust);

    void cancel() { thread_.request_stop(); }
    bool cancelled() const { return thread_.get_stop_token().stop_requested(); }
    bool done() const;
    OpeningProgress progress() const;

    const SceneRequest request;
    // Valid once done() is true:
    std::filesystem::path file;          ///< the scene that was opened: of a STEP file, the one made of its parts
    std::shared_ptr<HapticScene> scene;  ///< null on failure or cancel
    std::string error;

  private:
    engine::Scene read(const std::stop_token& stop, const std::filesystem::path& cache);
    void run(const std::stop_token& stop, const std::filesystem::path& treeCache,
             const std::function<Settings(const Settings&)>& adjust);

    mutable std::mutex mutex_;
    OpeningProgress progress_;
    bool done_ = false;
    std::jthread thread_;  // last member: joined before the members that it writes are destroyed
};

}  // namespace touchstone::sandbox
