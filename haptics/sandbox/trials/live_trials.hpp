#pragma once
// A study in the window: a person or a scripted hand does one trial after the other.
#include <deque>
#include <functional>

#include "engine/ui/widgets.hpp"
#include "haptics/sandbox/session/session.hpp"
#include "haptics/sandbox/trials/trial.hpp"

namespace touchstone::sandbox {

struct LiveTrialsOptions {
    std::deque<Trial> queue;  ///< trials to do, in order
    /// Returns the file of a condition's scene. Throws std::exception with one sentence.
    std::function<std::filesystem::path(const std::string&)> sceneFile;
    /// Returns a new, empty folder for a trial's recording.
    std::function<std::filesystem::path(const Trial&)> folder;
    /// Called when a trial has ended and its recording is complete.
    std::function<void(const Trial&, const nlohmann::ordered_json& row)> done;
};

/// Opens the scene of the first trial in the queue, waits for start(), records and measures until the trial ends, and
/// continues with the next one. A trial must be repeated if its scene, device or settings change on the way or if its
/// recording is incomplete. Used by the window's thread.
class LiveTrials {
  public:
    LiveTrials(const Protocol& protocol, LiveTrialsOptions options);

    /// The device between trials. It must not move by itself.
    std::string restingDevice() const;
    /// Callbacks for SessionOptions::adjust and SessionOptions::onTick.
    Settings settings(const Settings& scene) const;
    void add(const TickRecord& tick, LiveSession& session);
    /// Call once a frame.
    void update(LiveSession& session);

    /// Starts the trial's device at the scene's tool pose. A device with motors must then be engaged.
    void start(LiveSession& session);
    void abort();
    /// Draws the panel in the upper left of `picture` (x, y, x + width, y + height; screen units).
    void draw(LiveSession& session, const glm::vec4& picture, engine::ItemRects* items);

    /// What the participant has to do next, and how the last trial went; the latter is empty before the first one ends.
    std::string nextStep(const LiveSession& session) const;
    const std::string& lastOutcome() const { return lastOutcome_; }

    bool ready(const LiveSession& session) const;  ///< start() would start the trial
    bool running() const { return measures_.has_value(); }
    std::size_t left() const { return options_.queue.size(); }

  private:
    const Condition& condition() const;
    bool unedited(const LiveSession& session) const;
    bool shown(const LiveSession& session) const;
    bool unchangedSinceStart(const LiveSession& session) const;
    void open(LiveSession& session);
    void begin(LiveSession& session);
    void checkRunning(LiveSession& session);
    void repeat(LiveSession& session, const char* why);
    void finish(LiveSession& session);

    std::string nameOf(const Trial& trial) const;
    bool failed(const LiveSession& session) const;

    Protocol protocol_;
    LiveTrialsOptions options_;
    int opened_ = 0;  // number of the trial whose scene was opened last
    std::filesystem::path file_;
    std::uint64_t scene_ = 0;  // number of the session's scene before it was opened
    bool starting_ = false;    // waiting for the user to engage
    std::string device_;       // device at the start of the trial
    Settings settings_;        // settings at the start of the trial
    std::filesystem::path folder_;
    std::optional<TrialMeasures> measures_;
    std::optional<TickRecord> last_;
    std::optional<TrialEnd> end_;
    bool ticksLost_ = false;  // some ticks are missing
    bool complete_ = false;   // the recording was written completely
    std::string lastOutcome_;
};

}  // namespace touchstone::sandbox
