#include "haptics/sandbox/session/live_recording.hpp"
#include "haptics/threads/rt_thread.hpp"

#include <chrono>
#include <utility>

namespace touchstone::sandbox {

void LiveRecording::attach(HapticLoop& loop) {
    const std::lock_guard lock(mutex_);
    loop_ = &loop;
}

void LiveRecording::announce(std::uint64_t session, RecordedScene scene, const std::string& device) {
    announced_.push_back({session, std::move(scene), device});
    const std::lock_guard lock(mutex_);
    if (recorder_) recorder_->announce(session, announced_.back().scene, device);
}

void LiveRecording::begin(const std::filesystem::path& folder, std::uint64_t fromSession) {
    stop();
    const std::lock_guard lock(mutex_);
    try {
        recorder_ = std::make_unique<Recorder>(folder);
    } catch (const std::exception& e) {
        log_.say(Message::Kind::Error, failure_ = e.what());
        return;
    }
    fromSession_ = fromSession;
    rows_ = 0;
    failure_.clear();
    emptied_ = steadyNanoseconds();
    if (!lateRecorder_.joinable())
        lateRecorder_ = std::jthread([this](const std::stop_token& stopped) { recordLate(stopped); });
    for (const Announced& each : announced_) recorder_->announce(each.session, each.scene, each.device);
    log_.say(Message::Kind::Note, "Recording to " + folder.string());
}

bool LiveRecording::stop() {
    const std::lock_guard lock(mutex_);
    if (!recorder_) return false;
    recorder_->flush();
    const bool complete = recorder_->failure().empty();
    if (complete)
        log_.say(Message::Kind::Note, "The recording in " + recorder_->folder().string() + " has " +
                                          std::to_string(recorder_->rows()) + " ticks");
    else
        log_.say(Message::Kind::Error, failure_ = recorder_->failure());
    recorder_.reset();
    return complete;
}

void LiveRecording::take(const std::function<void(const RecordedTick&)>& onTick) {
    const std::lock_guard lock(mutex_);
    Taken taken;
    while (!waiting_.empty() || record(taken)) {
        if (!waiting_.empty()) {
            taken = waiting_.front();
            waiting_.pop_front();
        }
        rows_ = taken.rows;
        onTick(taken.tick);
        std::erase_if(announced_, [&](const Announced& each) { return each.session < taken.tick.session; });
    }
    emptied_ = steadyNanoseconds();
    if (recorder_ && !recorder_->failure().empty()) stop();
}

bool LiveRecording::record(Taken& taken) {
    if (!loop_ || !loop_->pop(taken.tick)) return false;
    if (recorder_ && taken.tick.session >= fromSession_) recorder_->add(taken.tick, loop_->obstaclesAtStart());
    taken.rows = recorder_ ? recorder_->rows() : 0;
    return true;
}

void LiveRecording::recordLate(const std::stop_token& stopped) {
    constexpr auto kPoll = std::chrono::milliseconds(40);
    constexpr std::uint64_t kLate = 80'000'000;  // ns without a frame; with kPoll a kill loses at most 0.12 s
    // Ticks that wait for a frame: a minute. Nobody watches a frame that is later; its plots may miss the oldest ticks.
    constexpr std::size_t kMaxWaiting = 60'000;
    while (!stopped.stop_requested()) {
        std::this_thread::sleep_for(kPoll);
        const std::lock_guard lock(mutex_);
        if (!recorder_ || !loop_ || steadyNanoseconds() - emptied_ < kLate) continue;
        for (Taken taken; record(taken);) waiting_.push_back(taken);
        recorder_->flush();
        while (waiting_.size() > kMaxWaiting) waiting_.pop_front();
    }
}

}  // namespace touchstone::sandbox
