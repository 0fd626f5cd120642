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
        std::string tree;     ///< hash of its leaf spheres; empty if it had none
        std::string surface;  ///< hash of its repaired mesh; empty if it had none, or in an old recording
        Pose X_WB;            ///< at the start
    };
    std::filesystem::path file;  ///< absolute
    std::string hash;            ///< of the file's bytes; empty if the file could not be read
    Body tool;
    std::vector<Body> obstacles;
};
RecordedScene recordedScene(const std::filesystem::path& file, const World& world);

/// Hash of the file's bytes; empty if the file cannot be read.
std::string hashOf(const std::filesystem::path& file);

/// A file that is sought by the hash of its content.
struct FoundFile {
    std::filesystem::path file;  ///< empty: no file
    bool same = false;           ///< it has the content
};
/// The first file with the content among `places`, each a file or a folder that has it under its name, and then among
/// the scene files of `folders`. If none has the content, the first of `places` that is there.
FoundFile findByContent(const std::filesystem::path& name, const std::string& hash,
                        const std::vector<std::filesystem::path>& places,
                        const std::vector<std::filesystem::path>& folders);

/// The folder of the bundled scenes.
std::filesystem::path bundledScenes();

/// Where the scene of a recording is now: at `named` (a file or a folder; empty: nowhere), in the recording's folder or
/// beside it, where it was, or among the bundled ones. A file with another content is found if none has the recorded
/// one. Throws std::runtime_error with one sentence, which ends with `advice`, if there is neither.
std::filesystem::path findRecordedScene(const RecordedScene& scene, const std::filesystem::path& recording,
                                        const std::filesystem::path& named, const std::string& advice,
                                        const std::filesystem::path& bundled = bundledScenes());

/// Whether the recorded parts had spheres, so that a replay needs them.
inline bool hadSpheres(const RecordedScene& scene) { return !scene.tool.tree.empty(); }

/// The world as it was recorded: the parts of `now`, if their hashes are the recorded ones, with the obstacles at their
/// recorded poses. Null if a part differs; `why` then says which one.
std::shared_ptr<const World> recordedWorld(const RecordedScene& scene, const std::shared_ptr<const World>& now,
                                           std::string& why);

}  // namespace touchstone::sandbox
