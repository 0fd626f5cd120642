#pragma once
// Takes ticks from the loop, records them, and passes them to the frame.
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "haptics/loop/haptic_loop.hpp"
#include "haptics/sandbox/record/recorder.hpp"
#include "haptics/sandbox/record/recording.hpp"
#include "haptics/sandbox/session/message_log.hpp"

namespace touchstone::sandbox {

/// Reads the loop's ring. If a frame is late, another thread records the ticks, so that a crash loses no more than
/// usual. Only the owning thread may call its functions.
class LiveRecording {
  public:
    explicit LiveRecording(MessageLog& log) : log_(log) {}

    /// The loop whose ticks are taken; it must outlive this object.
    void attach(HapticLoop& loop);
    /// Announces the scene and device of a session number, for the recording.
    void announce(std::uint64_t session, RecordedScene scene, const std::string& device);

    /// Records into a folder of its own, from the first tick of this session number on. A failure is a message.
    void begin(const std::filesystem::path& folder, std::uint64_t fromSession);
    /// Returns false if nothing was recorded or the recording is incomplete (reported as a message).
    bool stop();

    /// Calls `onTick` with every tick since the last call, in order, after it was recorded.
    void take(const std::function<void(const RecordedTick&)>& onTick);

    const Recorder* recorder() const { return recorder_.get(); }  ///< null while nothing is recorded
    /// Why the last recording stopped early; empty if it did not.
    const std::string& failure() const { return failure_; }
    /// Rows of the recording up to the tick that onTick saw last; the recording itself may be ahead.
    std::uint64_t rows() const { return rows_; }

  private:
    struct Taken {
        RecordedTick tick;
        std::uint64_t rows;  ///< of the recording, with it
    };
    struct Announced {
        std::uint64_t session;
        RecordedScene scene;
        std::string device;
    };
    /// Takes the next tick off the loop's ring, into the recording. Under mutex_.
    bool record(Taken& taken);
    void recordLate(const std::stop_token& stop);

    MessageLog& log_;
    HapticLoop* loop_ = nullptr;
    std::vector<Announced> announced_;
    std::string failure_;
    std::uint64_t rows_ = 0;
    std::recursive_mutex mutex_;  ///< on the loop's ring and all below, against recordLate()
    std::unique_ptr<Recorder> recorder_;
    std::uint64_t fromSession_ = 0;
    std::deque<Taken> waiting_;  ///< recorded by recordLate(), not seen by take() yet
    std::uint64_t emptied_ = 0;  ///< ns, when take() emptied the ring last
    std::jthread lateRecorder_;  // last: joined before what it uses goes
};

}  // namespace touchstone::sandbox
