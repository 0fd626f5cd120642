#pragma once
// A study in the window: a person, or a scripted hand, does one trial after the other.
#include <deque>
#include <functional>

#include "engine/ui/widgets.hpp"
#include "haptics/sandbox/session/session.hpp"
#include "haptics/sandbox/trials/trial.hpp"

namespace touchstone::sandbox {

struct LiveTrialsOptions {
    std::deque<Trial> queue;  ///< those to be done, in order
    /// Of a condition's scene; throws std::exception with one sentence.
    std::function<std::filesystem::path(const std::string&)> sceneFile;
    /// A new folder for a trial's recording, with nothing in it.
    std::function<std::filesystem::path(const Trial&)> folder;
    /// A trial has ended, and its recording is whole.
    std::function<void(const Trial&, const nlohmann::ordered_json& row)> done;
};

/// Opens the scene of the first trial of the queue, waits for start(), records and measures until it ends, and goes on
/// to the next. A trial whose scene, device or settings are changed on the way, or that is not recorded whole, is to be
/// done again. Used by the window's thread.
class LiveTrials {
  public:
    LiveTrials(const Protocol& protocol, LiveTrialsOptions options);

    /// The device of the window while nothing runs: it must not move by itself.
    std::string restingDevice() const;
    /// For SessionOptions::adjust and onTick.
    Settings settings(const Settings& scene) const;
    void add(const TickRecord& tick, LiveSession& session);
    /// To be called once a frame.
    void update(LiveSession& session);

    /// Puts the trial's device where the scene has the tool. A device with motors has to be engaged then.
    void start(LiveSession& session);
    void abort();
    /// Its panel in the upper left of the picture (x, y, x + width, y + height; screen units).
    void draw(LiveSession& session, const glm::vec4& picture, engine::ItemRects* items);

    bool ready(const LiveSession& session) const;  ///< start() would do something
    bool running() const { return measures_.has_value(); }
    std::size_t left() const { return options_.queue.size(); }

  private:
    const Condition& condition() const;
    bool untouched(const LiveSession& session) const;
    bool shown(const LiveSession& session) const;
    bool asStarted(const LiveSession& session) const;
    void open(LiveSession& session);
    void begin(LiveSession& session);
    void watch(LiveSession& session);
    void redo(LiveSession& session, const char* why);
    void finish(LiveSession& session);

    Protocol protocol_;
    LiveTrialsOptions options_;
    int opened_ = 0;  // number of the trial whose scene was asked for last
    std::filesystem::path file_;
    std::uint64_t scene_ = 0;  // number of the session's scene before that
    bool starting_ = false;    // waits to be engaged
    std::string device_;       // as started
    Settings settings_;        // likewise
    std::filesystem::path folder_;
    std::optional<TrialMeasures> measures_;
    std::optional<TickRecord> last_;
    std::optional<TrialEnd> end_;
    bool broken_ = false;  // a tick does not follow the one before
    bool whole_ = false;   // the recording is written to the end
};

}  // namespace touchstone::sandbox
