#pragma once
// The identity of a recorded scene: which file, which sphere trees, and where the bodies were.
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "haptics/loop/world.hpp"

namespace touchstone::sandbox {

/// What a world is made of, so that a replay can find it again and compare.
struct RecordedScene {
    struct Body {
        std::string name;
        std::string tree;  ///< hash of its leaf spheres
        Pose X_WB;         ///< at the start
    };
    std::filesystem::path file;  ///< absolute
    std::string hash;            ///< of the file's bytes; empty if the file could not be read
    Body tool;
    std::vector<Body> obstacles;
};
RecordedScene recordedScene(const std::filesystem::path& file, const World& world);

/// Hash of the file's bytes; empty if the file cannot be read.
std::string hashOf(const std::filesystem::path& file);

/// The world as it was recorded: the trees of `now`, if their hashes are the recorded ones, with the obstacles at their
/// recorded poses. Null if a tree differs; `why` then says which one.
std::shared_ptr<const World> recordedWorld(const RecordedScene& scene, const std::shared_ptr<const World>& now,
                                           std::string& why);

}  // namespace touchstone::sandbox
