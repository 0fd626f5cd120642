#pragma once
// A scene being read, and its trees built, on a thread of its own.
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

/// A scene file, what was changed in it by hand, and with which settings it is to run (nothing: as the scene asks).
struct SceneRequest {
    std::filesystem::path file;
    std::vector<engine::SceneEdit> edits = {};
    std::optional<Settings> settings = {};
};

/// The scene that is being opened, until it is shown.
struct OpeningProgress {
    std::string file;
    std::string part;         ///< what is being built; empty while the file is read, and at the end
    double fraction = 0;      ///< of all parts, 0 to 1
    double secondsLeft = -1;  ///< for this part, an estimate; negative while there is none
};

/// Begins when it is made; its destructor cancels it and waits for the thread.
class SceneOpening {
  public:
    SceneOpening(SceneRequest request, const std::filesystem::path& treeCache);

    void cancel() { thread_.request_stop(); }
    bool cancelled() const { return thread_.get_stop_token().stop_requested(); }
    bool done() const;
    OpeningProgress progress() const;

    const SceneRequest request;
    // Once done():
    std::shared_ptr<HapticScene> scene;  ///< null on failure or cancel
    std::string error;

  private:
    void run(const std::stop_token& stop, const std::filesystem::path& treeCache);

    mutable std::mutex mutex_;
    OpeningProgress progress_;
    bool done_ = false;
    std::jthread thread_;  // last: joined before what it writes goes
};

}  // namespace touchstone::sandbox
