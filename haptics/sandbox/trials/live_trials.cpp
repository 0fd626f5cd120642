#include "haptics/sandbox/trials/live_trials.hpp"

#include <nlohmann/json.hpp>

namespace touchstone::sandbox {

LiveTrials::LiveTrials(const Protocol& protocol, LiveTrialsOptions options)
    : protocol_(protocol), options_(std::move(options)) {}

const Condition& LiveTrials::condition() const {
    return protocol_.conditions[static_cast<std::size_t>(options_.queue.front().condition)];
}

std::string LiveTrials::restingDevice() const {
    const std::string device = options_.queue.empty() ? "" : condition().device;
    return movesByItself(device) ? "mouse" : device;
}

Settings LiveTrials::settings(const Settings& scene) const {
    return options_.queue.empty() ? scene : condition().settings(scene);
}

/// What was opened, as its file has it.
bool LiveTrials::untouched(const LiveSession& session) const {
    return session.newest().file == file_ && session.newest().edits.empty();
}

bool LiveTrials::shown(const LiveSession& session) const {
    return session.sceneNumber() != scene_ && session.running() && !session.opening() && untouched(session) &&
           session.scene()->roles.goal;
}

bool LiveTrials::asStarted(const LiveSession& session) const {
    return shown(session) && session.device() == device_ && session.settings() == settings_;
}

bool LiveTrials::ready(const LiveSession& session) const {
    return !running() && !starting_ && !options_.queue.empty() && opened_ == options_.queue.front().number &&
           shown(session) && !session.switching();
}

void LiveTrials::open(LiveSession& session) {
    opened_ = options_.queue.front().number;
    scene_ = session.sceneNumber();
    try {
        file_ = options_.sceneFile(condition().scene);
        session.open({.file = file_});
    } catch (const std::exception& error) {
        session.say(Message::Kind::Error, error.what());
    }
}

void LiveTrials::start(LiveSession& session) {
    if (!ready(session)) return;
    device_ = deviceOf(condition(), options_.queue.front());
    // Whatever was done to them since the scene was opened.
    session.setSettings(settings(session.scene()->settings));
    session.chooseDevice(device_, true);
    settings_ = session.settings();
    starting_ = session.device() == device_;  // else told by the session
    // One with motors holds the tool at the start until it is engaged.
    if (starting_ && !session.deviceFacts().limits.motors) begin(session);
}

void LiveTrials::begin(LiveSession& session) {
    starting_ = false;
    folder_ = options_.folder(options_.queue.front());
    session.record(folder_);
    if (!session.recorder()) return;  // told by the session
    measures_.emplace(*session.scene()->roles.goal, protocol_.limits);
    last_.reset();
    end_.reset();
    whole_ = broken_ = false;
}

void LiveTrials::abort() {
    if (running() && !end_) end_ = TrialEnd::Abort;
}

void LiveTrials::add(const TickRecord& tick, LiveSession& session) {
    // From where the recording begins to where it ends.
    if (!running() || end_ || !session.recorder() || session.recordedRows() == 0) return;
    broken_ |= last_ && tick.tick != last_->tick + 1;  // lost, or begun anew
    measures_->add(tick, 1000 / settings_.rate);
    last_ = tick;
    end_ = endOf(measures_->phases(), condition());
    if (end_) whole_ = session.stopRecording();
}

void LiveTrials::update(LiveSession& session) {
    if (options_.queue.empty()) return;
    starting_ &= asStarted(session);
    if (starting_ && !session.switching() && session.engaged()) begin(session);
    if (running()) watch(session);
    if (running() || options_.queue.empty()) return;
    const bool another = session.sceneNumber() != scene_ && !session.opening() && !untouched(session);
    if (another || opened_ != options_.queue.front().number) open(session);
}

void LiveTrials::watch(LiveSession& session) {
    const LoopSnapshot& loop = *session.snapshot();
    if (last_ && (loop.finished || loop.engagement == Engagement::Faulted)) abort();
    if (!asStarted(session)) return redo(session, "its scene, its device or a setting was changed");
    if (broken_) return redo(session, "ticks of it were lost, or it was restarted");
    if (end_ && !whole_) whole_ = last_ && session.stopRecording();
    if (!whole_ && (end_ || !session.recorder())) return redo(session, "it was not recorded to its end");
    if (end_) finish(session);
}

void LiveTrials::redo(LiveSession& session, const char* why) {
    if (!whole_) session.stopRecording();
    session.say(Message::Kind::Warning, std::string("The trial is to be done again: ") + why);
    measures_.reset();
    opened_ = 0;
}

void LiveTrials::finish(LiveSession& session) {
    const Trial trial = options_.queue.front();
    const nlohmann::ordered_json row =
        trialRow(*session.scene(), protocol_, trial, settings_, *measures_, *end_, last_->X_WT, folder_);
    measures_.reset();
    options_.queue.pop_front();
    options_.done(trial, row);
}

}  // namespace touchstone::sandbox
