#include "haptics/system/trials/live_trials.hpp"

namespace touchstone::system {
namespace {

std::uint64_t tripsOf(const LiveSession& session) {
    std::uint64_t trips = 0;
    if (const LoopSnapshot* loop = session.snapshot())
        for (const TripCount& count : loop->trips) trips += count.events;
    return trips;
}

}  // namespace

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

bool LiveTrials::ready(const LiveSession& session) const {
    return !running() && !options_.queue.empty() && opened_ == options_.queue.front().number && session.running() &&
           !session.opening() && session.sceneNumber() != scene_ && session.request().file == file_;
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
    const Trial& trial = options_.queue.front();
    const std::string device = deviceOf(condition(), trial);
    if (device != session.device()) session.chooseDevice(device);
    session.record(options_.folder(trial));
    if (!session.recorder()) return;  // told by the session
    measures_.emplace(*session.scene()->roles.goal, protocol_.limits);
    last_.reset();
    end_.reset();
    tripsBefore_ = tripsOf(session);
}

void LiveTrials::abort() {
    if (running() && !end_) end_ = TrialEnd::Abort;
}

void LiveTrials::add(const TickRecord& tick, const LiveSession& session) {
    // From where the recording begins.
    if (!running() || end_ || !session.recorder() || session.recorder()->rows() == 0) return;
    measures_->add(tick, 1000 / session.settings().rate);
    last_ = tick;
    end_ = endOf(measures_->phases(), condition());
}

void LiveTrials::update(LiveSession& session) {
    if (options_.queue.empty()) return;
    if (running() && !session.recorder()) abort();  // it was stopped by hand, or the disk is full
    const LoopSnapshot* loop = session.snapshot();
    if (running() && last_ && loop && (loop->finished || loop->engagement == Engagement::Faulted)) abort();
    if (running() && end_) finish(session);
    if (!running() && !options_.queue.empty() && opened_ != options_.queue.front().number) open(session);
}

void LiveTrials::finish(LiveSession& session) {
    const Trial trial = options_.queue.front();
    const bool whole = session.recorder() && session.recorder()->failure().empty() && last_;
    const std::filesystem::path folder = session.recorder() ? session.recorder()->folder() : "";
    session.stopRecording();
    if (whole) {
        const nlohmann::ordered_json row = trialRow(*session.scene(), protocol_, trial, session.settings(), *measures_,
                                                    *end_, tripsOf(session) - tripsBefore_, last_->X_WT, folder);
        options_.queue.pop_front();
        options_.done(trial, row);
    } else {
        session.say(Message::Kind::Warning, "The trial was not recorded to its end and is to be done again");
        opened_ = 0;
    }
    measures_.reset();
}

}  // namespace touchstone::system
