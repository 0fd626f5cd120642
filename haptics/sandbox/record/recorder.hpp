#pragma once
// Writing a recording: a folder with ticks.npy (the input and the record of every tick) and recording.json (everything
// else that a replay needs). See docs/recording.md.
#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>

#include "haptics/sandbox/record/recorded_scene.hpp"
#include "haptics/sandbox/record/tick_file.hpp"

namespace touchstone::sandbox {

/// Writes a recording. It begins with the first tick whose input has a `start`: see HapticLoop::forgetHistory(). What
/// has been written is complete and readable at every moment; call flush() at least every 0.25 s, and a crash loses no
/// more than that. One thread at a time. An error after construction stops the recording, and failure() reports it.
class Recorder {
  public:
    /// Throws std::runtime_error with one sentence if the folder already holds a recording, or cannot be made or
    /// written to. The files appear in it with the first tick.
    explicit Recorder(std::filesystem::path folder);
    ~Recorder();

    /// Sets the scene and the device of the ticks of this session. Call it before they arrive.
    void announce(std::uint64_t session, RecordedScene scene, std::string device);
    /// X_WO: obstacle poses at the moment of the tick's `start`, if it has one; empty: as in the scene.
    void add(const RecordedTick& tick, std::span<const Pose> X_WO = {});
    void flush();

    const std::filesystem::path& folder() const { return folder_; }
    /// May be called from any thread.
    std::uint64_t rows() const { return rows_; }
    std::uint64_t lost() const { return lost_; }  ///< ticks that never arrived, counted by gaps in their numbers
    /// One sentence if an error has stopped the recording; else empty.
    const std::string& failure() const { return failure_; }

  private:
    struct SessionFacts {
        RecordedScene scene;
        std::string device;
    };
    void begin(const RecordedTick& first, std::span<const Pose> X_WO);
    void noteChange(const RecordedTick& tick, const char* kind, nlohmann::ordered_json what);
    void noteChanges(const RecordedTick& tick, std::span<const Pose> X_WO);
    void fail(const std::exception& error);

    std::filesystem::path folder_;
    std::unique_ptr<TickFileWriter> ticks_;
    std::unique_ptr<RandomAccessFile> notes_;
    std::map<std::uint64_t, SessionFacts> sessions_;
    std::optional<RecordedTick> before_;
    std::string pendingChanges_;    // not yet written
    std::uint64_t changesEnd_ = 0;  // where they go in recording.json
    bool anyChange_ = false;
    std::atomic<std::uint64_t> rows_ = 0, lost_ = 0;
    std::chrono::steady_clock::time_point flushed_;
    std::string failure_;
};

}  // namespace touchstone::sandbox
