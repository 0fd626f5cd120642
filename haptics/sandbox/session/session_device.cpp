#include "haptics/sandbox/session/session.hpp"

#include <utility>

#include "haptics/loop/work_limits.hpp"
#include "haptics/sandbox/session/device_choice.hpp"
#include "haptics/sandbox/session/placed_device.hpp"

namespace touchstone::sandbox {
Settings LiveSession::capped(Settings settings) {
    settings = withinGains(settings, device_.facts.limits, device_.choice,
                           [this](Message::Kind kind, const std::string& text) { log_.say(kind, text); });
    saidByProcessor_ = false;
    for (const std::string& sentence : keepRoundTripsInTick(settings)) log_.say(Message::Kind::Warning, sentence);
    return settings;
}

void LiveSession::start(const Shown& next, const Settings& settings, const std::string& choice,
                        const Pose& X_WT_start) {
    std::shared_ptr<MouseTarget> mouse;
    std::unique_ptr<Device> device;
    std::vector<RecordedHand::Change> replayed;
    Settings begin = settings;
    if (const auto folder = recordingOf(choice)) {
        RecordedHand hand = recordedHand(*folder);
        device = std::make_unique<MotionDevice>(hand.motion);
        replayed = std::move(hand.changes);
        begin = options_.adjust ? options_.adjust(replayed.front().settings) : replayed.front().settings;
    } else {
        mouse = std::make_shared<MouseTarget>();
        device = startDevice(*next.scene, choice, mouse, X_WT_start);
        if (!traitsOf(choice).needsWindow) mouse.reset();
    }
    if (geometryOf(begin) == Geometry::Spheres && !next.world->hasSpheres()) {
        SceneRequest request = next.request;
        request.settings = begin;
        open(std::move(request));
        log_.say(Message::Kind::Note, "Sphere trees are built for these settings; then the scene starts again");
        return;
    }
    const bool first = !loop_;
    const std::uint64_t number = first ? 0 : loopSession_ + 1;
    recording_.announce(number, recordedScene(next.request.file, *next.world), choice);
    if (first && !options_.record.empty()) record(options_.record);
    const std::shared_ptr<DeviceControl> control = device->control();
    DeviceFacts facts{device->limits(), device->dynamics()};
    facts.scale = placeDevice(control.get(), workspaces_, next.request.file, choice);
    device_.facts = std::move(facts);
    device_.choice = choice;
    settings_ = capped(begin);
    const Settings inForce = inScene(settings_, device_.facts.scale);
    if (loop_) {
        loop_->open(next.world, inForce, std::move(device));
        ++loopSession_;
    } else {
        loop_ = std::make_unique<HapticLoop>(next.world, inForce, std::move(device), options_.loop);
        recording_.attach(*loop_);
        if (!loop_->realTime().message.empty()) log_.say(Message::Kind::Warning, loop_->realTime().message);
    }
    device_.mouse = std::move(mouse);
    device_.control = control;
    device_.trouble.clear();
    replayed_ = std::move(replayed);
    next_ = next;
    obstacleMoves_.reset();
}

void LiveSession::startOrMouse(const Shown& next, const Settings& settings, const std::string& choice,
                               const Pose& X_WT_start) {
    try {
        start(next, settings, choice, X_WT_start);
    } catch (const std::runtime_error& e) {
        if (traitsOf(choice).needsWindow) throw;
        log_.say(Message::Kind::Error, e.what());
        start(next, settings, "mouse", X_WT_start);
        device_.trouble = e.what();
    }
}

void LiveSession::chooseDevice(const std::string& choice, bool fromStart) {
    if (!running() || next_) return;
    // A device without a fixed pose moves to the tool; the tool never jumps to the device.
    const Shown now = shownNow();
    const bool resets = choice == device_.choice || fromStart;
    if (demonstration_ && resets) demonstration_.emplace(true);
    try {
        start(now, settings_, choice, resets ? now.world->X_WT_start : record()->X_WT);
        log_.say(Message::Kind::Note, "The " + device_.choice + " device holds the tool");
    } catch (const std::exception& e) {
        device_.trouble = e.what();
        log_.say(Message::Kind::Error, e.what());
    }
}

void LiveSession::setWorkspace(const Workspace& workspace) {
    if (!device_.control || device_.control->maps() == DeviceControl::Maps::Nothing || !running() || next_) return;
    if (const std::string wrong = checkWorkspace(workspace); !wrong.empty()) {
        log_.say(Message::Kind::Error, wrong);
        return;
    }
    try {
        workspaces_.save(shown_.request.file, device_.choice, workspace);
    } catch (const std::exception& e) {
        log_.say(Message::Kind::Error, e.what());
    }
    if (workspace.scale == device_.control->workspace().scale) {
        device_.control->setWorkspace(workspace);
        return;
    }
    try {
        start(shownNow(), settings_, device_.choice, record()->X_WT);
    } catch (const std::exception& e) {
        log_.say(Message::Kind::Error, e.what());
    }
}

void LiveSession::reconnectDevice() {
    if (device_.control) device_.control->reconnect();
}

void LiveSession::initializeDevice() {
    if (device_.control) device_.control->selfInitialize();
}

void LiveSession::sayDevice() {
    if (!device_.control) {
        device_.facts.status.reset();
        return;
    }
    DeviceStatus now = device_.control->status();
    const bool first = !device_.facts.status;
    if (first || now.state != device_.facts.status->state) {
        using State = DeviceStatus::State;
        const std::string text = "Device " + std::string(name(now.state)) + ": " + now.text;
        if (now.state == State::Lost || now.state == State::Fault)
            log_.say(Message::Kind::Error, text);
        else if (!first)
            log_.say(Message::Kind::Note, text);
    }
    device_.facts.status = std::move(now);
}

void LiveSession::setSettings(const Settings& settings) {
    if (const std::string wrong = checkSettings(settings); !wrong.empty()) {
        log_.say(Message::Kind::Error, wrong);
        return;
    }
    if (lacksSpheres(settings)) {
        log_.say(Message::Kind::Note, "Sphere trees are built for these settings; then the scene starts again");
        SceneRequest request = newest();
        request.settings = settings;
        open(std::move(request));
        return;
    }
    const Geometry before = geometryOf(settings_);
    settings_ = capped(settings);
    if (geometryOf(settings_) != before) saySpheres(shown_.scene.get());
    if (loop_ && (next_ || running())) loop_->setSettings(inScene(settings_, device_.facts.scale));
}

/// Whether these settings touch spheres that the world lacks: it was opened for meshes.
bool LiveSession::lacksSpheres(const Settings& settings) const {
    const World* world = next_ ? next_->world.get() : shown_.world.get();
    return world && geometryOf(settings) == Geometry::Spheres && !world->hasSpheres();
}

void LiveSession::buildTrees() {
    SceneRequest request = newest();
    if (request.allTrees || !shown_.world || shown_.world->hasSpheres()) return;
    log_.say(Message::Kind::Note, "Sphere trees are built to be shown; then the scene starts again");
    request.allTrees = true;
    request.settings = settings_;
    open(std::move(request));
}

void LiveSession::saySpheres(const HapticScene* scene) {
    if (!scene) return;
    for (const std::string& sentence : touchedBySpheres(*scene, settings_)) log_.say(Message::Kind::Warning, sentence);
}

void LiveSession::restart() {
    if (!running() || next_) return;
    if (device_.mouse || device_.control || moverOf(device_.choice) == Mover::Nothing)
        chooseDevice(device_.choice);
    else
        loop_->restart();
    if (demonstration_) demonstration_.emplace(true);
}

void LiveSession::stop() {
    if (loop_) loop_->stop();
}

void LiveSession::engage() {
    if (running() && !next_) loop_->engage();
}

bool LiveSession::engaged() const { return loop_ && isEngaged(loop_->snapshot().engagement); }

}  // namespace touchstone::sandbox
