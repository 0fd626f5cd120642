#include "haptics/system/session.hpp"

#include <algorithm>
#include <cstdio>
#include <mutex>
#include <thread>
#include <utility>

#include "engine/scene/gltf_read.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "haptics/system/device_choice.hpp"
#include "haptics/system/units.hpp"

namespace touchstone::system {
namespace {

constexpr std::size_t kMostMessages = 200;

/// As the tick needs them for the hand to feel them as they are set.
Settings inScene(Settings settings, double scale) {
    settings.torsion = std::clamp(torsionInScene(settings.torsion, scale), 1.0, 1e6);  // the setting's range
    return settings;
}

std::string asSentence(std::string text) {
    if (!text.empty() && text.back() != '.' && text.back() != '?') text += '.';
    return text;
}

}  // namespace

Settings withMode(Settings settings, Mode mode) {
    if (settings.mode == mode) return settings;
    const int pqp = findSolver("pqp");
    settings.mode = mode;
    settings.solver = mode == Mode::Paper ? pqp : kExactSolver;
    settings.shadow = mode == Mode::Default ? pqp : -1;
    settings.tolerance = 0.01;
    return settings;
}

Settings withSolversSwapped(Settings settings) {
    if (settings.shadow >= 0) std::swap(settings.solver, settings.shadow);
    return settings;
}

/// One scene being opened on a thread of its own.
class LiveSession::Opening {
  public:
    Opening(SceneRequest request_, const std::filesystem::path& treeCache)
        : request(std::move(request_)),
          thread_([this, treeCache](const std::stop_token& stop) { run(stop, treeCache); }) {}

    void cancel() { thread_.request_stop(); }
    bool cancelled() const { return thread_.get_stop_token().stop_requested(); }
    bool done() const {
        const std::lock_guard lock(mutex_);
        return done_;
    }
    OpeningProgress progress() const {
        const std::lock_guard lock(mutex_);
        return progress_;
    }

    const SceneRequest request;
    // Once done():
    std::shared_ptr<HapticScene> scene;  // null on failure or cancel
    std::string error;

  private:
    void run(const std::stop_token& stop, const std::filesystem::path& treeCache) {
        {
            const std::lock_guard lock(mutex_);
            progress_.file = request.file.filename().string();
        }
        SceneOptions options{.treeCache = treeCache, .progress = [&](const SceneStatus& status) {
                                 const std::lock_guard lock(mutex_);
                                 progress_.part = status.part;
                                 progress_.fraction = status.fraction;
                                 progress_.secondsLeft = status.secondsLeft;
                                 return !stop.stop_requested();
                             }};
        try {
            engine::Scene read = engine::readGltf(request.file);
            applyEdits(read, request.edits);
            scene = std::make_shared<HapticScene>(openScene(std::move(read), options));
        } catch (const BuildCancelled&) {
        } catch (const std::exception& e) {
            error = e.what();
        }
        const std::lock_guard lock(mutex_);
        done_ = true;
    }

    mutable std::mutex mutex_;
    OpeningProgress progress_;
    bool done_ = false;
    std::jthread thread_;  // last: joined before what it writes goes
};

LiveSession::LiveSession(SessionOptions options)
    : options_(std::move(options)), began_(steadyNanoseconds()), workspaces_(options_.configFolder) {}
LiveSession::~LiveSession() = default;

double LiveSession::secondsSinceStart() const { return static_cast<double>(steadyNanoseconds() - began_) * 1e-9; }

void LiveSession::say(Message::Kind kind, std::string text) {
    text = asSentence(std::move(text));
    if (messages_.size() == kMostMessages) messages_.erase(messages_.begin());
    messages_.push_back({kind, std::move(text), secondsSinceStart()});
}

void LiveSession::open(SceneRequest request) {
    cancelOpening();
    openings_.push_back(std::make_unique<Opening>(std::move(request), options_.treeCache));
}

void LiveSession::cancelOpening() {
    for (const auto& opening : openings_) opening->cancel();
}

std::optional<OpeningProgress> LiveSession::opening() const {
    if (next_ && next_->scene != shown_.scene)  // ready, and waiting for the loop to let go of the old one
        return OpeningProgress{.file = next_->request.file.filename().string(), .part = {}, .fraction = 1};
    if (openings_.empty() || openings_.back()->cancelled()) return std::nullopt;
    return openings_.back()->progress();
}

void LiveSession::reload() {
    if (shown_.scene) open({.file = shown_.request.file});
}

void LiveSession::edit(std::vector<SceneEdit> more) {
    std::vector<SceneEdit> edits = newest().edits;
    for (SceneEdit& edit : more) append(edits, std::move(edit));
    setEdits(std::move(edits));
}

const SceneRequest& LiveSession::newest() const {
    return next_                                                ? next_->request
           : openings_.empty() || openings_.back()->cancelled() ? shown_.request
                                                                : openings_.back()->request;
}

void LiveSession::setEdits(std::vector<SceneEdit> edits) {
    if (!shown_.scene) return;
    const auto changes = opening() ? std::nullopt : reversibleChange(newest().edits, edits);
    SceneRequest request{.file = newest().file, .edits = std::move(edits), .settings = settings_};
    const engine::Scene& scene = shown_.scene->scene;
    const auto keepsShapes = [&](const SceneEdit& edit) {
        const auto* place = std::get_if<PlaceNode>(&edit);
        return !place || movesRigidly(scene.registry, scene.nodes[static_cast<std::size_t>(place->node)]);
    };
    if (changes && std::all_of(changes->begin(), changes->end(), keepsShapes))
        change(std::move(request), *changes);
    else
        open(std::move(request));
}

/// Where that makes the tool start elsewhere, it does: in a world of the same trees.
void LiveSession::change(SceneRequest request, const std::vector<SceneEdit>& changes) {
    HapticScene& scene = *shown_.scene;
    applyEdits(scene.scene, changes);
    const bool moved = std::any_of(changes.begin(), changes.end(),
                                   [](const SceneEdit& edit) { return std::holds_alternative<PlaceNode>(edit); });
    Shown next{std::move(request), shown_.scene, moved ? worldAsPlaced(scene) : nullptr};
    if (!next.world || !loop_ || next.world->X_WT_start == scene.world->X_WT_start) {
        (next_ ? next_->request : shown_.request) = std::move(next.request);
        return;
    }
    try {
        startOrMouse(next, settings_, device_);
    } catch (const std::exception& e) {
        say(Message::Kind::Error, e.what());
    }
}

bool LiveSession::save(const std::filesystem::path& file, bool withSettings) {
    if (!shown_.scene) return false;
    if (opening()) {
        say(Message::Kind::Error, "The scene is still being opened: save it when it is shown");
        return false;
    }
    HapticScene& scene = *shown_.scene;
    try {
        if (withSettings) system::setSettings(scene.scene, scene.roles, settings_);
        saveScene(scene.scene, file);
    } catch (const std::exception& e) {
        say(Message::Kind::Error, e.what());
        return false;
    }
    scene.scene.file = file;
    shown_.request = {.file = file};
    if (next_) next_->request = shown_.request;
    say(Message::Kind::Note, "The scene is saved in " + file.string());
    return true;
}

Settings LiveSession::capped(Settings settings) {
    const DeviceLimits& limits = facts_.limits;
    const auto cap = [&](double& gain, double most, const char* name, const char* unit) {
        if (gain <= most) return;
        char text[200];
        std::snprintf(text, sizeof text, "The %s device is made for a %s of %g %s, so %g is lowered to that",
                      device_.substr(0, device_.find(':')).c_str(), name, most, unit, gain);
        say(Message::Kind::Warning, text);
        gain = most;
    };
    cap(settings.stiffness, limits.nominalStiffness, "stiffness", "N/mm");
    cap(settings.torsion, limits.nominalTorsion, "torsion", "mN·m/rad");
    return settings;
}

void LiveSession::start(const Shown& next, const Settings& settings, const std::string& choice,
                        const Pose& X_WT_start) {
    std::shared_ptr<MouseTarget> mouse;
    std::unique_ptr<Device> device;
    std::vector<RecordedHand::Change> replayed;
    Settings begin = settings;
    if (choice == "mouse") {
        mouse = std::make_shared<MouseTarget>();
        device = std::make_unique<MouseDevice>(mouse, X_WT_start);
    } else if (const auto folder = recordingOf(choice)) {
        RecordedHand hand = recordedHand(*folder);
        device = std::make_unique<MotionDevice>(hand.motion);
        replayed = std::move(hand.changes);
        begin = options_.adjust ? options_.adjust(replayed.front().settings) : replayed.front().settings;
    } else {
        device = startDevice(*next.scene, choice, nullptr, X_WT_start);
    }
    const bool first = !loop_;
    const std::uint64_t number = first ? 0 : loopSession_ + 1;
    given_.push_back({number, recordedScene(next.request.file, *next.world), choice});
    if (recorder_) recorder_->announce(number, given_.back().scene, choice);
    if (first && !options_.record.empty()) record(options_.record);
    const std::shared_ptr<DeviceControl> control = device->control();
    DeviceFacts facts{device->limits(), device->dynamics()};
    if (control && control->maps() != DeviceControl::Maps::Nothing) {
        const Workspace workspace = workspaces_.load(next.request.file, choice);
        control->setWorkspace(workspace);  // before the loop asks for limits
        if (control->maps() == DeviceControl::Maps::All) facts.scale = workspace.scale;
    }
    facts_ = std::move(facts);
    device_ = choice;
    settings_ = capped(begin);
    const Settings inForce = inScene(settings_, facts_.scale);
    if (loop_) {
        loop_->open(next.world, inForce, std::move(device));
        ++loopSession_;
    } else {
        loop_ = std::make_unique<HapticLoop>(next.world, inForce, std::move(device), options_.loop);
        if (!loop_->realTime().message.empty()) say(Message::Kind::Warning, loop_->realTime().message);
    }
    mouse_ = std::move(mouse);
    control_ = control;
    trouble_.clear();
    replayed_ = std::move(replayed);
    next_ = next;
    targets_.clear();
}

void LiveSession::startOrMouse(const Shown& next, const Settings& settings, const std::string& choice) {
    const Pose X_WT_start = next.world->X_WT_start;
    try {
        start(next, settings, choice, X_WT_start);
    } catch (const std::runtime_error& e) {
        if (choice == "mouse") throw;
        say(Message::Kind::Error, e.what());
        start(next, settings, "mouse", X_WT_start);
        trouble_ = e.what();
    }
}

void LiveSession::takeOpened() {
    for (auto& opening : openings_) {
        if (!opening->done()) continue;
        const std::unique_ptr<Opening> ready = std::move(opening);
        if (ready->cancelled()) continue;
        if (!ready->scene) {
            say(Message::Kind::Error, ready->error);
            continue;
        }
        const Shown next{ready->request, ready->scene, ready->scene->world};
        for (const std::string& warning : next.scene->warnings) say(Message::Kind::Warning, warning);
        try {
            const Settings settings = next.request.settings ? *next.request.settings
                                      : options_.adjust     ? options_.adjust(next.scene->settings)
                                                            : next.scene->settings;
            if (!next.scene->world) {
                // A scene without roles is shown, so that they can be given; the tool of the old one lets go.
                say(Message::Kind::Note, next.scene->missing);
                if (loop_) {
                    Settings paused = settings_;
                    paused.pause = true;
                    loop_->setSettings(paused);
                }
                settings_ = settings;
                next_.reset();
                show(next);
                continue;
            }
            // What a hand holds stays in it.
            const bool goesOn = control_ || (next.request.settings && !device_.empty() && device_ != "demo");
            startOrMouse(next, settings,
                         goesOn                      ? device_
                         : !options_.device.empty()  ? options_.device
                         : next.scene->demonstration ? "demo"
                                                     : "mouse");
            say(Message::Kind::Note, next.request.file.filename().string() + " runs with the " + device_ + " device");
        } catch (const std::exception& e) {
            say(Message::Kind::Error, next.request.file.filename().string() + ": " + e.what());
        }
    }
    std::erase(openings_, nullptr);
}

void LiveSession::show(Shown next) {
    if (next.scene != shown_.scene) {
        ++sceneNumber_;
        history_.clear();
    }
    shown_ = std::move(next);
    if (shown_.scene) shown_.scene->world = shown_.world;
    toldTrips_ = {};
}

/// Obstacles go where the scene has them; its world has them where they are.
void LiveSession::moveObstacles() {
    HapticScene& scene = *shown_.scene;
    const std::vector<Pose>& X_WO = loop_->snapshot().X_WO;
    const auto isThere = [](const Obstacle& obstacle, const Pose& X) { return obstacle.X_WO == X; };
    if (!std::equal(scene.world->obstacles.begin(), scene.world->obstacles.end(), X_WO.begin(), X_WO.end(), isThere)) {
        auto world = std::make_shared<World>(*scene.world);
        for (std::size_t k = 0; k < X_WO.size(); ++k) world->obstacles[k].X_WO = X_WO[k];
        scene.world = shown_.world = std::move(world);
    }
    std::vector<Pose> targets;
    for (const engine::Entity obstacle : scene.roles.obstacles)
        targets.push_back(toPose(engine::worldPose(scene.scene.registry, obstacle)));
    if (targets != targets_) loop_->moveObstacles(targets_ = targets);
}

void LiveSession::tellHeld() {
    constexpr int kTellAfter = 20;  // ticks: an obstacle that finds its way in shorter moves is not worth a word
    const std::vector<Pose>& X_WO = loop_->snapshot().X_WO;
    const auto [held, target] = std::mismatch(X_WO.begin(), X_WO.end(), targets_.begin(), targets_.end());
    if (held == X_WO.end() || target == targets_.end())
        toldHeld_ = false;
    else if (heldTicks_ >= kTellAfter && !std::exchange(toldHeld_, true))
        say(Message::Kind::Warning,
            shown_.scene->scene.registry
                    .get<engine::Name>(shown_.scene->roles.obstacles[static_cast<std::size_t>(held - X_WO.begin())])
                    .value +
                " stays where it is while the tool has no room to give way: move it back, or the tool");
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

void LiveSession::tellDevice() {
    if (!control_) {
        facts_.status.reset();
        return;
    }
    DeviceStatus now = control_->status();
    const bool first = !facts_.status;
    if (first || now.state != facts_.status->state) {
        using State = DeviceStatus::State;
        const std::string text = "Device " + std::string(name(now.state)) + ": " + now.text;
        if (now.state == State::Lost || now.state == State::Fault)
            say(Message::Kind::Error, text);
        else if (!first)
            say(Message::Kind::Note, text);
    }
    facts_.status = std::move(now);
}

void LiveSession::setWorkspace(const Workspace& workspace) {
    if (!control_ || control_->maps() == DeviceControl::Maps::Nothing || !running() || next_) return;
    if (const std::string wrong = checkWorkspace(workspace); !wrong.empty()) {
        say(Message::Kind::Error, wrong);
        return;
    }
    try {
        workspaces_.save(shown_.request.file, device_, workspace);
    } catch (const std::exception& e) {
        say(Message::Kind::Error, e.what());
    }
    if (workspace.scale == control_->workspace().scale) {
        control_->setWorkspace(workspace);
        return;
    }
    try {
        start(shown_, settings_, device_, record()->X_WT);
    } catch (const std::exception& e) {
        say(Message::Kind::Error, e.what());
    }
}

void LiveSession::reconnectDevice() {
    if (control_) control_->reconnect();
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
    if (options_.onTick) options_.onTick(tick.record);
    if (recorder_) recorder_->add(tick, loop_->obstaclesAtStart());
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
    for (const Given& given : given_) recorder_->announce(given.number, given.scene, given.device);
    if (loop_) loop_->beginAnew();
    say(Message::Kind::Note, "Recording to " + folder.string());
}

void LiveSession::stopRecording() {
    if (!recorder_) return;
    recorder_->flush();
    if (recorder_->failure().empty())
        say(Message::Kind::Note, "The recording in " + recorder_->folder().string() + " has " +
                                     std::to_string(recorder_->rows()) + " ticks");
    else
        say(Message::Kind::Error, recorder_->failure());
    recorder_.reset();
}

void LiveSession::setSettings(const Settings& settings) {
    if (const std::string wrong = checkSettings(settings); !wrong.empty()) {
        say(Message::Kind::Error, wrong);
        return;
    }
    settings_ = capped(settings);
    if (loop_ && (next_ || running())) loop_->setSettings(inScene(settings_, facts_.scale));
}

void LiveSession::restart() {
    if (!running() || next_) return;
    if (mouse_ || control_)
        chooseDevice(device_);
    else
        loop_->restart();
}

void LiveSession::stop() {
    if (loop_) loop_->stop();
}

void LiveSession::engage() {
    if (running() && !next_) loop_->engage();
}

bool LiveSession::engaged() const { return loop_ && isEngaged(loop_->snapshot().engagement); }

void LiveSession::chooseDevice(const std::string& choice) {
    if (!running() || next_) return;
    // The device is set onto the tool where it is free, never the tool onto the device.
    const World& world = *shown_.scene->world;
    try {
        start(shown_, settings_, choice, choice != device_ ? record()->X_WT : world.X_WT_start);
        say(Message::Kind::Note, "The " + device_ + " device holds the tool");
    } catch (const std::exception& e) {
        trouble_ = e.what();
        say(Message::Kind::Error, e.what());
    }
}

}  // namespace touchstone::system
