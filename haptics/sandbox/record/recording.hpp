#pragma once
// Reading a recording: its ticks one after the other, its device poses as a motion, its repair and its export.
// See docs/recording.md.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "haptics/hands/motion.hpp"
#include "haptics/sandbox/record/recorded_scene.hpp"
#include "haptics/sandbox/record/tick_file.hpp"

namespace touchstone::sandbox {

/// Reads a recording from its start. Throws std::runtime_error with one sentence that names the file and the field.
class Recording {
  public:
    explicit Recording(std::filesystem::path folder);

    /// Reads the next tick in full; its `session` counts the changes of scene before it. False after the last tick.
    bool next(RecordedTick& tick);
    std::uint64_t rows() const { return ticks_.rows(); }
    /// Obstacle poses at the newest `start`; empty: as in the scene.
    const std::vector<Pose>& obstacles() const { return X_WO_; }
    /// Scene of the newest tick; before next() was called, of the first one.
    const RecordedScene& scene() const { return scene_; }
    const std::string& device() const { return device_; }
    const Settings& settings() const { return settings_; }
    /// True once if ticks were lost right before the newest one.
    bool takeGap() { return std::exchange(gap_, false); }
    const nlohmann::json& header() const { return *header_; }
    /// One sentence for each way in which this program differs from the one that recorded.
    std::vector<std::string> programDifferences() const;

  private:
    [[noreturn]] void fail(const std::string& what) const;
    void apply(const nlohmann::json& change);
    void begin(const nlohmann::json& start);

    std::filesystem::path folder_;
    std::shared_ptr<const nlohmann::json> header_;
    TickFileReader ticks_;
    RecordedScene scene_;
    std::string device_;
    Settings settings_;
    std::optional<TickStart> start_;
    std::vector<Pose> X_WO_;
    std::size_t nextChange_ = 0;
    std::uint64_t scenes_ = 0;
    bool gap_ = false;
};

/// True if the folder holds a recording, or the remains of one.
bool isRecording(const std::filesystem::path& folder);

/// The settings and the device poses of a recording as a motion for a live loop: it runs at the recorded rate and
/// begins where the tool was.
struct RecordedHand {
    struct Change {
        double t;  ///< ms
        Settings settings;
    };
    std::shared_ptr<const Motion> motion;
    std::vector<Change> changes;  ///< the first at 0
};
/// Reads up to the first change of scene. Throws as Recording.
RecordedHand recordedHand(const std::filesystem::path& folder);

/// Repairs a recording that a crash interrupted; returns what was done, one sentence a line. Throws std::runtime_error
/// with one sentence if it cannot be repaired.
std::string recoverRecording(const std::filesystem::path& folder);

/// Writes all columns of the ticks as CSV. Needs only ticks.npy. Throws std::runtime_error with one sentence.
void exportCsv(const std::filesystem::path& folder, const std::filesystem::path& file);

}  // namespace touchstone::sandbox
