#pragma once
// A recording: a folder with ticks.npy, what every tick was given and what it did, and recording.json, all else that is
// needed to repeat it. See docs/recording.md.
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "haptics/device/motion.hpp"
#include "haptics/loop/world.hpp"
#include "haptics/sandbox/record/tick_file.hpp"

namespace touchstone::sandbox {

/// What a world is made of, to be found again and compared.
struct RecordedScene {
    struct Body {
        std::string name;
        std::string tree;  ///< hash of its spheres
        Pose X_WB;         ///< at the start
    };
    std::filesystem::path file;  ///< absolute
    std::string hash;            ///< of the file's bytes; empty where it could not be read
    Body tool;
    std::vector<Body> obstacles;
};
RecordedScene recordedScene(const std::filesystem::path& file, const World& world);
/// Of the file's bytes; empty where it cannot be read.
std::string hashOf(const std::filesystem::path& file);

/// The world as it was recorded: `now`'s trees where they are those recorded, its obstacles where they stood. Null when
/// a tree is another; `why` then tells which.
std::shared_ptr<const World> recordedWorld(const RecordedScene& scene, const std::shared_ptr<const World>& now,
                                           std::string& why);

/// Writes a recording. It begins with the first tick whose input tells a start: see HapticLoop::beginAnew(). What has
/// been written is whole and readable at every moment; flush() at least every 0.25 s makes a crash lose no more.
/// One thread at a time. What goes wrong after the constructor stops the recording and is told by failure().
class Recorder {
  public:
    /// Throws std::runtime_error with one sentence when there is a recording already, or the folder cannot be made or
    /// written to. Files appear in it with the first tick.
    explicit Recorder(std::filesystem::path folder);
    ~Recorder();

    /// Ticks of the session of this number are in this scene and with this device. Before they come.
    void announce(std::uint64_t session, RecordedScene scene, std::string device);
    /// X_WO: where the obstacles were when the tick's start, if it tells one, was made; empty: where the scene has
    /// them.
    void add(const RecordedTick& tick, std::span<const Pose> X_WO = {});
    void flush();

    const std::filesystem::path& folder() const { return folder_; }
    /// Of any thread.
    std::uint64_t rows() const { return rows_; }
    std::uint64_t lost() const { return lost_; }  ///< ticks that never came, by their numbers
    /// One sentence when the recording had to stop; else empty.
    const std::string& failure() const { return failure_; }

  private:
    struct SessionFacts {
        RecordedScene scene;
        std::string device;
    };
    void begin(const RecordedTick& first, std::span<const Pose> X_WO);
    void change(const RecordedTick& tick, const char* kind, nlohmann::ordered_json what);
    void noteChanges(const RecordedTick& tick, std::span<const Pose> X_WO);
    void fail(const std::exception& error);

    std::filesystem::path folder_;
    std::unique_ptr<TickFileWriter> ticks_;
    std::unique_ptr<RandomAccessFile> notes_;
    std::map<std::uint64_t, SessionFacts> sessions_;
    std::optional<RecordedTick> before_;
    std::string changes_;          // not yet written
    std::uint64_t changesAt_ = 0;  // where they go in recording.json
    bool anyChange_ = false;
    std::atomic<std::uint64_t> rows_ = 0, lost_ = 0;
    std::chrono::steady_clock::time_point flushed_;
    std::string failure_;
};

/// Reads a recording from its start. Throws std::runtime_error with one sentence that names the file and the field.
class Recording {
  public:
    explicit Recording(std::filesystem::path folder);

    /// The next tick whole, its `session` the number of scenes before its own; false after the last.
    bool next(RecordedTick& tick);
    std::uint64_t rows() const { return ticks_.rows(); }
    /// Where the obstacles were at the newest start; empty: where the scene has them.
    const std::vector<Pose>& obstacles() const { return X_WO_; }
    /// Of the newest tick; before the first, of that.
    const RecordedScene& scene() const { return scene_; }
    const std::string& device() const { return device_; }
    const Settings& settings() const { return settings_; }
    /// Ticks were lost right before the newest; asking forgets it.
    bool takeGap() { return std::exchange(gap_, false); }
    const nlohmann::json& header() const { return header_; }
    /// Sentences on how the program that wrote it is another than this.
    std::vector<std::string> otherProgram() const;

  private:
    [[noreturn]] void fail(const std::string& what) const;
    void apply(const nlohmann::json& change);
    void begin(const nlohmann::json& start);

    std::filesystem::path folder_;
    nlohmann::json header_;
    TickFileReader ticks_;
    RecordedScene scene_;
    std::string device_;
    Settings settings_;
    std::optional<StepStart> start_;
    std::vector<Pose> X_WO_;
    std::size_t nextChange_ = 0;
    std::uint64_t scenes_ = 0;
    bool gap_ = false;
};

/// A folder that holds a recording, or what is left of one.
bool isRecording(const std::filesystem::path& folder);

/// Settings and the device's poses as a motion, for a live loop: with the pace of the recorded rate, from where the
/// tool was.
struct RecordedHand {
    struct Change {
        double t;  ///< ms
        Settings settings;
    };
    std::shared_ptr<const Motion> motion;
    std::vector<Change> changes;  ///< the first at 0
};
/// Up to the first change of scene. Throws as Recording.
RecordedHand recordedHand(const std::filesystem::path& folder);

/// Makes what a crash left of a recording whole; says what was done in one sentence a line. Throws std::runtime_error
/// with one sentence when that cannot be.
std::string recoverRecording(const std::filesystem::path& folder);

/// The ticks as CSV with all columns. Needs ticks.npy alone. Throws std::runtime_error with one sentence.
void exportCsv(const std::filesystem::path& folder, const std::filesystem::path& file);

}  // namespace touchstone::sandbox
