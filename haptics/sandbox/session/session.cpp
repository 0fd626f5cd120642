#include "haptics/sandbox/session/session.hpp"

#include <utility>

namespace touchstone::sandbox {
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
    {
        const std::lock_guard lock(ticksMutex_);
        Taken taken;
        while (!waiting_.empty() || record(taken)) {
            if (!waiting_.empty()) {
                taken = waiting_.front();
                waiting_.pop_front();
            }
            recordedRows_ = taken.rows;
            take(taken.tick);
        }
        taken_ = steadyNanoseconds();
        if (recorder_ && !recorder_->failure().empty()) stopRecording();
    }
    followRecordedSettings();
    if (!running() || next_) return;
    moveObstacles();
    tellHeld();
    tellTrips(loop_->snapshot());
}

bool LiveSession::record(Taken& taken) {
    if (!loop_->pop(taken.tick)) return false;
    if (recorder_ && taken.tick.session >= recordFrom_) recorder_->add(taken.tick, loop_->obstaclesAtStart());
    taken.rows = recorder_ ? recorder_->rows() : 0;
    return true;
}

void LiveSession::recordLate(const std::stop_token& stop) {
    constexpr auto kLook = std::chrono::milliseconds(40);
    constexpr std::uint64_t kLate = 80'000'000;  // ns without a frame
    constexpr std::size_t kMostWaiting = 60'000;
    while (!stop.stop_requested()) {
        std::this_thread::sleep_for(kLook);
        const std::lock_guard lock(ticksMutex_);
        if (!recorder_ || !loop_ || steadyNanoseconds() - taken_ < kLate) continue;
        for (Taken taken; record(taken);) waiting_.push_back(taken);
        recorder_->flush();
        // A frame that takes a minute is one that nobody looks at: its plots may miss the oldest ticks.
        while (waiting_.size() > kMostWaiting) waiting_.pop_front();
    }
}

void LiveSession::take(const RecordedTick& tick) {
    history_.push(tick.record);
    heldTicks_ = tick.record.flags & kObstacleHeld ? heldTicks_ + 1 : 0;
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
    const std::lock_guard lock(ticksMutex_);
    try {
        recorder_ = std::make_unique<Recorder>(folder);
    } catch (const std::exception& e) {
        say(Message::Kind::Error, recordingFailure_ = e.what());
        return;
    }
    recordFrom_ = loopSession_;
    recordedRows_ = 0;
    recordingFailure_.clear();
    taken_ = steadyNanoseconds();
    if (!lateRecorder_.joinable())
        lateRecorder_ = std::jthread([this](const std::stop_token& stop) { recordLate(stop); });
    for (const Given& given : given_) recorder_->announce(given.number, given.scene, given.device);
    if (loop_) loop_->beginAnew();
    say(Message::Kind::Note, "Recording to " + folder.string());
}

bool LiveSession::stopRecording() {
    const std::lock_guard lock(ticksMutex_);
    if (!recorder_) return false;
    recorder_->flush();
    const bool whole = recorder_->failure().empty();
    if (whole)
        say(Message::Kind::Note, "The recording in " + recorder_->folder().string() + " has " +
                                     std::to_string(recorder_->rows()) + " ticks");
    else
        say(Message::Kind::Error, recordingFailure_ = recorder_->failure());
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

}  // namespace touchstone::sandbox
