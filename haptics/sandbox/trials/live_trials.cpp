#include "haptics/sandbox/trials/live_trials.hpp"

#include <array>
#include <nlohmann/json.hpp>

#include "engine/scene/text.hpp"

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

/// Whether the session shows the opened file without edits.
bool LiveTrials::unedited(const LiveSession& session) const {
    return session.newest().file == file_ && session.newest().edits.empty();
}

bool LiveTrials::shown(const LiveSession& session) const {
    return session.sceneNumber() != scene_ && session.running() && !session.opening() && unedited(session) &&
           session.scene()->roles.goal;
}

bool LiveTrials::unchangedSinceStart(const LiveSession& session) const {
    return shown(session) && session.device().choice == device_ && session.settings() == settings_;
}

bool LiveTrials::ready(const LiveSession& session) const {
    return !running() && !starting_ && !options_.queue.empty() && opened_ == options_.queue.front().number &&
           shown(session) && !session.switching();
}

/// Whether the scene was not opened: an error, or the user canceled it.
bool LiveTrials::failed(const LiveSession& session) const { return !shown(session) && !session.opening(); }

std::string LiveTrials::nameOf(const Trial& trial) const {
    return "participant " + protocol_.participants[static_cast<std::size_t>(trial.participant)].name + ", " +
           protocol_.conditions[static_cast<std::size_t>(trial.condition)].name;
}

std::string LiveTrials::nextStep(const LiveSession& session) const {
    if (options_.queue.empty()) return "All trials are done. Close the window for the summary.";
    const bool watching = movesByItself(condition().device);
    if (running()) {
        if (watching) return "Watch: the scripted hand does this trial.";
        constexpr std::array kSteps{"Bring the tool to its goal.", "Feel for the way into the goal.",
                                    "Align the tool with the way into the goal.",
                                    "Push the tool in until it rests at the goal.",
                                    "The tool is at the goal. Let it go and hold still."};
        if (measures_->phases().jammed()) return "The tool is jammed. Pull it back a little and try again.";
        return kSteps[static_cast<std::size_t>(measures_->phases().phase())];
    }
    if (starting_) return "The tool is held at the start. Press Space to engage it.";
    if (ready(session))
        return watching ? "Press Start, and watch the scripted hand."
                        : "Press Start. The trial is over when the tool rests at its goal.";
    return failed(session) ? "The scene is not open. Press Open scene." : "Wait until the scene is open.";
}

void LiveTrials::open(LiveSession& session) {
    opened_ = options_.queue.front().number;
    scene_ = session.sceneNumber();
    try {
        file_ = options_.sceneFile(condition().scene);
        session.open({.file = file_});
    } catch (const std::exception& error) {
        session.log().say(Message::Kind::Error, error.what());
    }
}

void LiveTrials::start(LiveSession& session) {
    if (!ready(session)) return;
    device_ = deviceOf(condition(), options_.queue.front());
    // The user may have changed settings since the scene was opened.
    session.setSettings(settings(session.scene()->settings));
    session.chooseDevice(device_, true);
    settings_ = session.settings();
    starting_ = session.device().choice == device_;  // else the session reports why
    // A device with motors holds the tool at the start until it is engaged.
    if (starting_ && !session.device().facts.limits.motors) begin(session);
}

void LiveTrials::begin(LiveSession& session) {
    starting_ = false;
    folder_ = options_.folder(options_.queue.front());
    session.record(folder_);
    if (!session.recording().recorder()) return;  // the session reports why
    measures_.emplace(*session.scene()->roles.goal, protocol_.limits);
    last_.reset();
    end_.reset();
    complete_ = ticksLost_ = false;
}

void LiveTrials::abort() {
    if (running() && !end_) end_ = TrialEnd::Abort;
}

void LiveTrials::add(const TickRecord& tick, LiveSession& session) {
    // Measure exactly the ticks that are recorded.
    if (!running() || end_ || !session.recording().recorder() || session.recording().rows() == 0) return;
    ticksLost_ |= last_ && tick.tick != last_->tick + 1;  // ticks were lost, or the device was reset
    measures_->add(tick, 1000 / settings_.rate);
    last_ = tick;
    end_ = endOf(measures_->phases(), condition());
    if (end_) complete_ = session.recording().stop();
}

void LiveTrials::update(LiveSession& session) {
    if (options_.queue.empty()) return;
    starting_ &= unchangedSinceStart(session);
    if (starting_ && !session.switching() && session.engaged()) begin(session);
    if (running()) checkRunning(session);
    if (running() || options_.queue.empty()) return;
    const bool another = session.sceneNumber() != scene_ && !session.opening() && !unedited(session);
    if (another || opened_ != options_.queue.front().number) open(session);
}

void LiveTrials::checkRunning(LiveSession& session) {
    const LoopSnapshot& loop = *session.snapshot();
    if (last_ && (loop.finished || loop.engagement == Engagement::Faulted)) abort();
    if (!unchangedSinceStart(session)) return repeat(session, "its scene, its device or a setting was changed");
    if (ticksLost_) return repeat(session, "ticks were lost, or it was reset");
    if (end_ && !complete_) complete_ = last_ && session.recording().stop();
    if (!complete_ && (end_ || !session.recording().recorder())) return repeat(session, "its recording is incomplete");
    if (end_) finish(session);
}

void LiveTrials::repeat(LiveSession& session, const char* why) {
    if (!complete_) session.recording().stop();
    lastOutcome_ =
        "Trial " + std::to_string(options_.queue.front().number) + " must be repeated: " + std::string(why) + ".";
    session.log().say(Message::Kind::Warning, std::string("The trial must be repeated: ") + why);
    measures_.reset();
    opened_ = 0;
}

void LiveTrials::finish(LiveSession& session) {
    const Trial trial = options_.queue.front();
    lastOutcome_ = engine::formatted("Trial %d, %s: %s after %.1f s.", trial.number, nameOf(trial).c_str(), name(*end_),
                                     measures_->phases().elapsed() / 1000);
    const nlohmann::ordered_json row =
        trialRow(*session.scene(), protocol_, trial, settings_, *measures_, *end_, *last_, folder_);
    measures_.reset();
    options_.queue.pop_front();
    options_.done(trial, row);
}

}  // namespace touchstone::sandbox
