#include "haptics/system/session.hpp"

#include <utility>

namespace touchstone::system {
namespace {

constexpr std::size_t kMostMessages = 200;

std::string asSentence(std::string text) {
    if (!text.empty() && text.back() != '.' && text.back() != '?') text += '.';
    return text;
}

}  // namespace

LiveSession::LiveSession(SessionOptions options)
    : options_(std::move(options)), began_(steadyNanoseconds()), workspaces_(options_.configFolder) {}
LiveSession::~LiveSession() = default;

double LiveSession::secondsSinceStart() const { return static_cast<double>(steadyNanoseconds() - began_) * 1e-9; }

void LiveSession::say(Message::Kind kind, std::string text) {
    text = engine::escaped(asSentence(std::move(text)));  // it may quote names out of files
    if (messages_.size() == kMostMessages) messages_.erase(messages_.begin());
    messages_.push_back({kind, std::move(text), secondsSinceStart()});
}

void LiveSession::update() {
    takeOpened();
    tellDevice();
    if (!loop_) return;
    if (loop_->poll() && loop_->snapshot().session == loopSession_) {
        ticked_ = true;
        if (next_) {
            show(std::move(*next_));
            next_.reset();
        }
    }
    if (loop_->hangs() && !toldHang_)
        say(Message::Kind::Error, "The haptic thread hangs, and the " + device_ +
                                      " device was told to let go: if it still pushes, switch it off");
    toldHang_ = loop_->hangs();
    for (WholeTick tick; loop_->pop(tick);) take(tick);
    if (recorder_ && !recorder_->failure().empty()) stopRecording();
    followRecordedSettings();
    if (!running() || next_) return;
    moveObstacles();
    tellHeld();
    tellTrips(loop_->snapshot());
}

void LiveSession::take(const WholeTick& tick) {
    history_.push(tick.record);
    heldTicks_ = tick.record.flags & kObstacleHeld ? heldTicks_ + 1 : 0;
    if (recorder_ && tick.session >= recordFrom_) recorder_->add(tick, loop_->obstaclesAtStart());
    if (options_.onTick) options_.onTick(tick.record);
    std::erase_if(given_, [&](const Given& given) { return given.number < tick.session; });
    if (tick.session != loopSession_ || replayed_.empty()) return;
    if (tick.input.start) {
        replayMs_ = 0;
        nextReplayed_ = 0;
    }
    replayMs_ += 1000 / tick.input.settings.rate;
}

/// At a frame's precision; ramps are the loop's own.
void LiveSession::followRecordedSettings() {
    const Settings* due = nullptr;
    for (; nextReplayed_ < replayed_.size() && replayed_[nextReplayed_].t <= replayMs_; ++nextReplayed_)
        due = &replayed_[nextReplayed_].settings;
    if (due) setSettings(options_.adjust ? options_.adjust(*due) : *due);
}

void LiveSession::record(const std::filesystem::path& folder) {
    stopRecording();
    try {
        recorder_ = std::make_unique<Recorder>(folder);
    } catch (const std::exception& e) {
        say(Message::Kind::Error, e.what());
        return;
    }
    recordFrom_ = loopSession_;
    for (const Given& given : given_) recorder_->announce(given.number, given.scene, given.device);
    if (loop_) loop_->beginAnew();
    say(Message::Kind::Note, "Recording to " + folder.string());
}

bool LiveSession::stopRecording() {
    if (!recorder_) return false;
    recorder_->flush();
    const bool whole = recorder_->failure().empty();
    if (whole)
        say(Message::Kind::Note, "The recording in " + recorder_->folder().string() + " has " +
                                     std::to_string(recorder_->rows()) + " ticks");
    else
        say(Message::Kind::Error, recorder_->failure());
    recorder_.reset();
    return whole;
}

void LiveSession::tellTrips(const LoopSnapshot& snapshot) {
    for (std::size_t i = 0; i < toldTrips_.size(); ++i) {
        const std::uint64_t events = snapshot.trips[i].events;
        const Trip trip = static_cast<Trip>(i);
        const bool fault = info(trip).follows == Follows::Fault;
        if (events > toldTrips_[i] && (fault || toldTrips_[i] == 0))
            say(Message::Kind::Warning, std::string("Safety, ") + name(trip) + ": " + info(trip).why +
                                            (fault ? " There is no force until you engage: Space." : ""));
        toldTrips_[i] = events;
    }
}

}  // namespace touchstone::system
