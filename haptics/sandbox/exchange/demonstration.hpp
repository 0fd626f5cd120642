#pragma once
// What a demonstration holds that other programs read, and the proof that it is true: a recording whose replay agrees
// with every recorded tick. Both file formats are written from it, and `verify` makes it again. See docs/recording.md.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "haptics/sandbox/record/recorded_scene.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// How far a replay may deviate in another build or on another processor: there the last bits of a tick differ, and a
/// step that is limited by a count may end elsewhere. In the same build it must not deviate at all.
struct Tolerance {
    double position = 1e-6;  ///< mm, of the tool pose
    double angle = 1e-8;     ///< rad, of the tool pose
    double force = 1e-6;     ///< N
    double torque = 1e-4;    ///< mN·m
};
inline constexpr Tolerance kTolerance;

/// How the replay of a demonstration agrees with its ticks.
struct Agreement {
    std::uint64_t ticks = 0, same = 0;       ///< same: all bits that repeat
    std::optional<std::uint64_t> different;  ///< first row with other bits
    std::string where;                       ///< its first field with other bits, with both values
    double position = 0, angle = 0;          ///< largest deviation of the tool pose, mm and rad
    double force = 0, torque = 0;            ///< and of the wrench, N and mN·m
    std::vector<std::string> otherBuild;     ///< how program or processor differ from those that recorded
    bool withinTolerance() const;
};

/// A column of a table, or several that follow each other in a tick.
struct Array {
    std::string name;   ///< below the demonstration, as obs/tool_pose
    const char* type;   ///< NumPy's notation; empty: whole ticks, with the columns of tickFields()
    std::size_t width;  ///< numbers a row
    std::string bytes;  ///< row after row, little endian
    std::string help;   ///< one line, with the names of the columns
};

/// A file that a scene consists of.
struct SceneFile {
    std::string scene;           ///< content hash of the .gltf or .glb
    std::filesystem::path name;  ///< relative to that file's folder, in normal form
    std::string hash;            ///< of its content
    std::filesystem::path place;
};
/// The scene's file, then the files that it refers to. Throws std::exception with one sentence.
std::vector<SceneFile> sceneFiles(const std::filesystem::path& file);

struct Demonstration {
    std::string name;                   ///< demo_0, demo_1, …
    std::string notes;                  ///< recording.json, unchanged
    std::vector<RecordedScene> scenes;  ///< in the order of the ticks
    std::string device;
    nlohmann::ordered_json settings, goal;  ///< at the start; goal: null without one
    std::string rows;                       ///< all ticks, packed
    std::vector<std::uint64_t> chain;       ///< of each tick: hash of the row and of the link before; see chainOf()
    std::vector<double> time;               ///< of each tick, ms since the first
    std::vector<bool> inGoal;               ///< whether the tool was in the goal region
    double penetration = 0;                 ///< no tick overlaps deeper, mm: measured by the true gaps
    Agreement agreement;

    std::size_t ticks() const { return chain.size(); }
    bool goalMet() const { return !inGoal.empty() && inGoal.back(); }
    /// Bytes of a column of a tick, followed by the columns after it. Pre: `column` is one of tickFields().
    const char* at(std::size_t tick, std::string_view column) const;
};

/// The links of the chain over packed ticks: the first continues the hash of recording.json, each one the one before.
std::vector<std::uint64_t> chainOf(std::string_view notes, std::string_view rows);

/// The arrays of a demonstration: `ticks` and `chain`, which are the proof, then those made from them.
std::vector<Array> arraysOf(const Demonstration& demonstration);

/// Finds and opens scenes; keeps the newest, since the demonstrations of a file often share it.
class SceneShelf {
  public:
    /// `named`: a scene file or a folder of scenes, given by the user; if empty, findRecordedScene() searches for them.
    explicit SceneShelf(SceneProgress progress = {}, std::filesystem::path named = {})
        : progress_(std::move(progress)), named_(std::move(named)) {}
    /// Throws std::runtime_error with one sentence.
    std::filesystem::path find(const RecordedScene& scene, const std::filesystem::path& recording) const {
        return findRecordedScene(scene, recording, named_, "put it beside the recording, or name it with --scene");
    }
    /// Throws engine::SceneError.
    const HapticScene& open(const std::filesystem::path& file, bool allTrees, const Settings& settings);

  private:
    SceneProgress progress_;
    std::filesystem::path named_;
    HapticScene scene_;
    std::string key_;
};

/// Replays a recording and makes a demonstration of it. Throws std::runtime_error with one sentence if the recording
/// cannot be read, if its scene is missing, or if the replay does not agree: not to the bit in the same build, not
/// within the tolerance in another.
Demonstration replayDemonstration(const std::filesystem::path& recording, std::string name, SceneShelf& scenes);

}  // namespace touchstone::sandbox
