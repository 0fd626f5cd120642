#include "haptics/sandbox/session/session.hpp"

#include <utility>

#include "haptics/threads/rt_thread.hpp"

namespace touchstone::sandbox {

LiveSession::LiveSession(SessionOptions options) : options_(std::move(options)), workspaces_(options_.configFolder) {}
LiveSession::~LiveSession() = default;

void LiveSession::update() {
    takeOpened();
    sayDevice();
    if (!loop_) return;
    if (loop_->poll() && loop_->snapshot().session == loopSession_) {
        ticked_ = true;
        if (next_) {
            show(std::move(*next_));
            next_.reset();
            returnFreedMemory();  // of the scene before
        }
    }
    if (loop_->hangs() && !saidHang_)
        log_.say(Message::Kind::Error, "The haptic thread hangs. The forces of the " + device_.choice +
                                           " device were released: if it still pushes, switch it off");
    saidHang_ = loop_->hangs();
    recording_.take([this](const RecordedTick& tick) { take(tick); });
    followRecordedSettings();
    if (demonstration_ && demonstration_->duration() > kLongestDemonstrationMs) finishDemonstration();
    if (!running() || next_) return;
    obstacleMoves_.update(*shown_.scene, settings_, *loop_, log_);
    sayTrips(loop_->snapshot());
}

void LiveSession::take(const RecordedTick& tick) {
    history_.push(tick.record);
    obstacleMoves_.count(tick.record);
    if (demonstration_) demonstration_->add(tick);
    if (const bool left = tick.record.flags & kByProcessor; left && !std::exchange(saidByProcessor_, true))
        log_.say(
            Message::Kind::Warning,
            "The solver's card was late or lost: in such ticks pqp solves on the processor. If this persists, choose "
            "another solver");
    if (options_.onTick) options_.onTick(tick.record);
    if (tick.session != loopSession_ || replayed_.empty()) return;
    if (tick.start) {
        replayMs_ = 0;
        nextReplayed_ = 0;
    }
    replayMs_ += 1000 / tick.settings.rate;
}

/// Applies recorded settings, accurate to one frame; the loop itself ramps them.
void LiveSession::followRecordedSettings() {
    const Settings* due = nullptr;
    for (; nextReplayed_ < replayed_.size() && replayed_[nextReplayed_].t <= replayMs_; ++nextReplayed_)
        due = &replayed_[nextReplayed_].settings;
    if (due) setSettings(options_.adjust ? options_.adjust(*due) : *due);
}

void LiveSession::record(const std::filesystem::path& folder) {
    recording_.begin(folder, loopSession_);
    if (recording_.recorder() && loop_) loop_->forgetHistory();
}

void LiveSession::sayTrips(const LoopSnapshot& snapshot) {
    for (std::size_t i = 0; i < saidTrips_.size(); ++i) {
        const std::uint64_t events = snapshot.trips[i].events;
        const Trip trip = static_cast<Trip>(i);
        const bool fault = info(trip).follows == Follows::Fault;
        if (events > saidTrips_[i] && (fault || saidTrips_[i] == 0))
            log_.say(Message::Kind::Warning, std::string("Safety, ") + name(trip) + ": " + info(trip).why +
                                                 (fault ? " There is no force until you engage: Space." : ""));
        saidTrips_[i] = events;
    }
}

}  // namespace touchstone::sandbox
