#pragma once
// What a dialog shows of scene files: a picture and a sentence each, made in the background.
#include <condition_variable>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::sandbox {

struct SceneCard {
    std::string text;  ///< extras.touchstone.description of the scene, or why the file cannot be read; may be empty
    engine::Image picture;  ///< of the scene at its start; empty if it could not be made
    bool complete = false;  ///< false: the picture is still to come
};

/// Makes the cards on its own thread, with its own OpenGL context. Pictures are kept as PNG in `FOLDER/pictures`, by
/// path, size and time of the scene's file; with an empty folder only in memory.
class SceneCards {
  public:
    static constexpr int kWidth = 240, kHeight = 150;  ///< of a picture, pixels

    explicit SceneCards(std::filesystem::path folder);
    ~SceneCards();  ///< waits for the card that is being made

    /// The card, which is made if this is the first request of the file; those requested last come first.
    std::shared_ptr<const SceneCard> find(const std::filesystem::path& scene);

  private:
    void run(const std::stop_token& stop);
    void set(const std::filesystem::path& scene, SceneCard card);

    const std::filesystem::path folder_;
    std::mutex mutex_;  // guards the next three
    std::condition_variable_any changed_;
    std::vector<std::filesystem::path> wanted_;
    std::map<std::filesystem::path, std::shared_ptr<const SceneCard>> cards_;
    std::jthread thread_;  // last member: joined before the others are destroyed
};

}  // namespace touchstone::sandbox
