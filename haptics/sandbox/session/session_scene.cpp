#include "haptics/sandbox/session/session.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "haptics/sandbox/scene/scene_motion.hpp"
#include "haptics/sandbox/session/device_choice.hpp"
#include "haptics/sandbox/session/goal_edit.hpp"

namespace touchstone::sandbox {

void LiveSession::open(SceneRequest request) {
    cancelOpening();
    openings_.push_back(std::make_unique<SceneOpening>(std::move(request), options_.treeCache, options_.adjust));
}

void LiveSession::cancelOpening() {
    for (const auto& opening : openings_) opening->cancel();
}

std::optional<OpeningProgress> LiveSession::opening() const {
    if (next_ && next_->scene != shown_.scene)  // ready; waits until the loop has released the old scene
        return OpeningProgress{.file = next_->request.file.filename().string(), .part = {}, .fraction = 1};
    if (openings_.empty() || openings_.back()->cancelled()) return std::nullopt;
    return openings_.back()->progress();
}

void LiveSession::reload() {
    if (shown_.scene) open({.file = shown_.request.file});
}

void LiveSession::edit(std::vector<engine::SceneEdit> more) {
    std::vector<engine::SceneEdit> edits = newest().edits;
    for (engine::SceneEdit& edit : more) append(edits, std::move(edit));
    setEdits(std::move(edits));
}

void LiveSession::mark(const std::vector<Marking>& markings) {
    if (!shown_.scene) return;
    std::vector<engine::SceneEdit> edits = newest().edits;
    try {
        for (const Marking& marking : markings) appendMarking(edits, shown_.scene->scene, marking);
    } catch (const engine::SceneError& e) {
        log_.say(Message::Kind::Error, e.what());
        return;
    }
    setEdits(std::move(edits));
}

const SceneRequest& LiveSession::newest() const {
    return next_                                                ? next_->request
           : openings_.empty() || openings_.back()->cancelled() ? shown_.request
                                                                : openings_.back()->request;
}

void LiveSession::setEdits(std::vector<engine::SceneEdit> edits) {
    if (!shown_.scene) return;
    const auto changes = opening() ? std::nullopt : engine::reversibleChange(newest().edits, edits);
    SceneRequest request{
        .file = newest().file, .edits = std::move(edits), .settings = settings_, .allTrees = newest().allTrees};
    const engine::Scene& scene = shown_.scene->scene;
    const auto keepsShapes = [&](const engine::SceneEdit& edit) {
        const auto* place = std::get_if<engine::PlaceNode>(&edit);
        return !place || (place->from.scale == place->to.scale &&
                          movesRigidly(scene.registry, scene.nodes[static_cast<std::size_t>(place->node)]));
    };
    if (changes && std::all_of(changes->begin(), changes->end(), keepsShapes))
        change(std::move(request), *changes);
    else
        open(std::move(request));
}

void LiveSession::setGoalHere() {
    if (!running() || next_ || opening()) return;
    edit(goalHere(*shown_.scene, record()->X_WT, geometryOf(settings_)));
    if (shown_.scene->roles.goalNode)
        log_.say(Message::Kind::Note, "The goal is where the tool is now: " +
                                          nodeLabel(shown_.scene->scene, shown_.scene->roles.goalNode) + " has it");
}

/// If the start of the tool moved, starts there in a world with the same trees.
void LiveSession::change(SceneRequest request, const std::vector<engine::SceneEdit>& changes) {
    HapticScene& scene = *shown_.scene;
    engine::applyEdits(scene.scene, changes);
    const bool looksOnly = std::all_of(changes.begin(), changes.end(), [](const engine::SceneEdit& edit) {
        return std::holds_alternative<engine::PaintMaterial>(edit) || std::holds_alternative<engine::RenameNode>(edit);
    });
    Shown next{std::move(request), shown_.scene, nullptr};
    if (!looksOnly) try {
            next.world = worldAsPlaced(scene);
        } catch (const engine::SceneError& e) {
            log_.say(Message::Kind::Error, e.what());
            if (const auto back = engine::reversibleChange(next.request.edits, newest().edits)) {
                engine::applyEdits(scene.scene, *back);
                worldAsPlaced(scene);
            }
            return;
        }
    const bool newMotion = std::any_of(changes.begin(), changes.end(), [](const engine::SceneEdit& edit) {
        return std::holds_alternative<engine::SetMotion>(edit);
    });
    if (!next.world || !loop_ || (!newMotion && next.world->X_WT_start == scene.world->X_WT_start)) {
        (next_ ? next_->request : shown_.request) = std::move(next.request);
        return;
    }
    try {
        startOrMouse(next, settings_, device_.choice, newMotion && running() ? record()->X_WT : next.world->X_WT_start);
    } catch (const std::exception& e) {
        log_.say(Message::Kind::Error, e.what());
    }
}

void LiveSession::recordDemonstration() {
    if (!running() || opening()) return;
    const engine::Scene& scene = shown_.scene->scene;
    if (scene.registry.get<engine::LocalTransform>(shown_.scene->roles.tool).shear != glm::dmat3(1)) {
        log_.say(Message::Kind::Error, nodeLabel(scene, shown_.scene->roles.tool) +
                                           " is sheared, so glTF cannot store a motion of it: remove the shear");
        return;
    }
    demonstration_.emplace();
    log_.say(Message::Kind::Note, "The motion of the " + device_.choice + " device is recorded as demonstration");
}

void LiveSession::finishDemonstration() {
    if (!demonstration_) return;
    const MotionRecorder recorded = *std::exchange(demonstration_, std::nullopt);
    if (!recorded.moved()) {
        log_.say(Message::Kind::Warning, "The device did not move, so the demonstration stays as it was");
        return;
    }
    const engine::Entity tool = shown_.scene->roles.tool;
    engine::SetMotion motion{.node = engine::nodeIndex(shown_.scene->scene, tool), .from = {}, .to = {}};
    for (const engine::SceneEdit& edit : newest().edits)
        if (const auto* earlier = std::get_if<engine::SetMotion>(&edit); earlier && earlier->node == motion.node)
            motion.from = earlier->to;
    const std::vector<MotionKey> keys = recorded.keys();
    motion.to = std::make_shared<const engine::Animation>(animationOf(shown_.scene->scene, tool, keys));
    edit({std::move(motion)});
    char text[160];
    std::snprintf(text, sizeof text, "The demonstration of %.1f s has %zu keys; Ctrl+S saves it with the scene",
                  recorded.duration() / 1000, keys.size());
    log_.say(Message::Kind::Note, text);
}

bool LiveSession::save(const std::filesystem::path& file, bool withSettings) {
    if (!shown_.scene) return false;
    if (opening()) {
        log_.say(Message::Kind::Error, "The scene is still being opened: save it when it is shown");
        return false;
    }
    HapticScene& scene = *shown_.scene;
    try {
        if (withSettings) sandbox::setSettings(scene.scene, scene.roles, settings_);
        engine::saveScene(scene.scene, file);
    } catch (const std::exception& e) {
        log_.say(Message::Kind::Error, e.what());
        return false;
    }
    scene.scene.file = file;
    shown_.request = {.file = file};
    if (next_) next_->request = shown_.request;
    log_.say(Message::Kind::Note, "The scene is saved in " + file.string());
    return true;
}

void LiveSession::takeOpened() {
    // They are taken out first, since a start may open its scene again.
    std::vector<std::unique_ptr<SceneOpening>> done;
    for (auto& opening : openings_)
        if (opening->done()) done.push_back(std::move(opening));
    std::erase(openings_, nullptr);
    for (const auto& ready : done) {
        if (ready->cancelled()) continue;
        if (!ready->scene) {
            log_.say(Message::Kind::Error, ready->error);
            continue;
        }
        Shown next{ready->request, ready->scene, ready->scene->world};
        if (next.request.file != ready->file) {
            log_.say(Message::Kind::Note, "The parts of " + next.request.file.string() +
                                              " became a scene: choose the tool and its obstacles, and save it");
            next.request.file = ready->file;
        }
        for (const std::string& warning : next.scene->warnings) log_.say(Message::Kind::Warning, warning);
        for (const std::string& sentence : reshapedSentences(*next.scene)) log_.say(Message::Kind::Note, sentence);
        try {
            const Settings settings = next.request.settings ? *next.request.settings
                                      : options_.adjust     ? options_.adjust(next.scene->settings)
                                                            : next.scene->settings;
            if (!next.scene->world) {
                // Show a scene without roles, so that the user can give them, and pause the old one.
                log_.say(Message::Kind::Note, next.scene->missing);
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
            // Keep a hardware device, or the device of an edited scene, across the change.
            const bool goesOn = device_.control || (next.request.settings && !device_.choice.empty() &&
                                                    !followsDemonstration(device_.choice));
            startOrMouse(next, settings,
                         goesOn                     ? device_.choice
                         : !options_.device.empty() ? options_.device
                                                    : defaultDevice(*next.scene, true),
                         next.world->X_WT_start);
            saySpheres(next.scene.get());
            log_.say(Message::Kind::Note,
                     next.request.file.filename().string() + " runs with the " + device_.choice + " device");
        } catch (const std::exception& e) {
            log_.say(Message::Kind::Error, next.request.file.filename().string() + ": " + e.what());
        }
    }
}

LiveSession::Shown LiveSession::shownNow() const { return {shown_.request, shown_.scene, worldNow(*shown_.scene)}; }

void LiveSession::show(Shown next) {
    if (next.scene != shown_.scene) {
        ++sceneNumber_;
        history_.clear();
        if (std::exchange(demonstration_, std::nullopt))
            log_.say(Message::Kind::Warning, "The demonstration is not recorded, since the scene was opened again");
    }
    shown_ = std::move(next);
    if (shown_.scene) {
        shown_.scene->world = shown_.world;
        shown_.scene->X_WO.clear();
        if (shown_.world)
            for (const Obstacle& obstacle : shown_.world->obstacles) shown_.scene->X_WO.push_back(obstacle.X_WO);
    }
    saidTrips_ = {};
}

}  // namespace touchstone::sandbox
