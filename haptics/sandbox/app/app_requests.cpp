#include <imgui_internal.h>

#include <ctime>
#include <stdexcept>
#include <utility>

#include "engine/edit/scene_edit.hpp"
#include "haptics/files/output_file.hpp"
#include "haptics/sandbox/app/app.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "haptics/sandbox/session/device_choice.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "haptics/sandbox/trials/protocol.hpp"

namespace touchstone::sandbox {

void App::noteState() {
    const std::string name = session_.request().file.stem().string();
    const std::string title =
        viewed_ ? "Touchstone - " + name + (session_.newest().edits.empty() ? "" : " *") : "Touchstone";
    if (title != title_) window_.setTitle(title_ = title);
    if (!viewed_ || session_.opening()) return;
    if (undoFile_ != session_.request().file) {
        undo_.clear();
        undoFile_ = session_.request().file;
    }
    UserState now{session_.newest().edits, session_.settings()};
    now.settings.pause = false;
    undo_.note(now, !ImGui::IsAnyItemActive() && !selection_.dragging());
}

void App::restoreState(const std::optional<UserState>& state) {
    if (!state) return;
    Settings settings = state->settings;
    settings.pause = session_.settings().pause;
    session_.setSettings(settings);
    if (state->edits != session_.newest().edits) session_.setEdits(state->edits);
}

void App::copyCommand() {
    if (!session_.running()) return;
    if (!session_.newest().edits.empty()) {
        session_.log().say(Message::Kind::Warning,
                           "The command would run the scene's file without your changes: save the scene first");
        return;
    }
    std::string device = session_.device().choice;
    if (traitsOf(device).needsWindow) device = defaultDevice(*viewed_, false);  // mouse input cannot be repeated
    const std::string line =
        commandLine(std::filesystem::absolute(session_.request().file), device, viewed_->settings, session_.settings());
    ImGui::SetClipboardText(line.c_str());
    session_.log().say(Message::Kind::Note, "Copied: " + line);
}

void App::toggleRecording() {
    if (session_.recording().recorder()) {
        session_.recording().stop();
        return;
    }
    const std::time_t now = std::time(nullptr);
    char when[32] = "";
    std::strftime(when, sizeof when, "-%Y%m%d-%H%M%S", std::localtime(&now));
    session_.record(options_.recordings / (session_.request().file.stem().string() + when));
}

void App::makeStudy(const std::filesystem::path& folder) {
    if (!session_.running() || session_.opening()) return;
    // A copy, so that later changes of the scene leave the study as it is.
    const std::filesystem::path protocol = folder / kStudyFile, scene = folder / session_.request().file.filename();
    try {
        if (!viewed_->roles.goal)
            throw std::runtime_error(
                "A study needs a goal: put the tool where it should end and choose \"Set goal here\"");
        if (std::filesystem::exists(protocol))
            throw std::runtime_error("'" + folder.string() + "' holds a study already: choose another folder");
        std::error_code ignored;  // writing says why
        std::filesystem::create_directories(folder, ignored);
        engine::saveScene(viewed_->scene, scene);
        writeFile(protocol, "the protocol",
                  firstStudy(scene.filename().string(), scene.stem().string()).dump(1) + "\n");
        const std::string line =
            "touchstone trials " + shellQuoted(protocol.string()) + " --headless --out " + shellQuoted(folder.string());
        ImGui::SetClipboardText(line.c_str());
        session_.log().say(Message::Kind::Note,
                           "The study is made. " + line + " runs it; the command is on the clipboard");
    } catch (const std::exception& error) {
        session_.log().say(Message::Kind::Error, error.what());
    }
}

void App::carryOut() {
    PanelRequests requests = std::exchange(requests_, {});
    if (requests.leaves() && !requests.discard && !session_.newest().edits.empty()) {
        menu_.leaving = std::exchange(requests, {});
        menu_.leaveDialog = true;
    }
    if (!requests.refusal.empty()) session_.log().say(Message::Kind::Error, requests.refusal);
    if (requests.open) session_.open({.file = *requests.open});
    if (requests.reload) session_.reload();
    if (requests.cancelOpening) session_.cancelOpening();
    if (!requests.edits.empty()) session_.edit(requests.edits);
    if (!requests.markings.empty()) session_.mark(requests.markings);
    if (requests.save && session_.save(*requests.save, requests.saveSettings)) {
        viewedFile_ = session_.request().file;
        undo_.clear();  // its states are changes of the file as it was
        recent_.add(viewedFile_);
    }
    if (requests.study) makeStudy(*requests.study);
    if (requests.undo && session_.opening())
        session_.cancelOpening();
    else if (requests.undo)
        restoreState(undo_.undo());
    if (requests.redo && !session_.opening()) restoreState(undo_.redo());
    if (requests.view) camera_.look(*requests.view);
    if (requests.frameSelection && viewed_)
        fitPoints(camera_, selection_.corners(*viewed_, toolPoses()), picture_.size.x / picture_.size.y);
    if (requests.copyCommand) copyCommand();
    if (requests.record) toggleRecording();
    if (requests.setGoal) {
        session_.setGoalHere();
        if (viewed_ && viewed_->roles.goalNode) selection_.select(viewed_->roles.goalNode);  // shows its tolerances
    }
    if (requests.recordDemonstration)
        session_.demonstration() ? session_.finishDemonstration() : session_.recordDemonstration();
    if (requests.replayDemonstration) session_.chooseDevice("demo", true);
    if (requests.checkFit) measure_.checkFit(session_);
    if (requests.device) session_.chooseDevice(*requests.device);
    if (requests.workspace) session_.setWorkspace(*requests.workspace);
    if (requests.alignWithView && session_.device().control.get()) {
        Workspace workspace = session_.device().control.get()->workspace();
        workspace.q_WD = toEigen(glm::dquat(glm::quat_cast(glm::transpose(glm::mat3(camera_.view())))));
        session_.setWorkspace(workspace);
    }
    if (requests.reconnect) session_.reconnectDevice();
    if (requests.initializeDevice) session_.initializeDevice();
    if (requests.restart) session_.restart();
    if (display_.trees() && std::exchange(treesFor_, session_.sceneNumber()) != session_.sceneNumber())
        session_.buildTrees();
    if (requests.stopOrEngage) session_.engaged() ? session_.stop() : session_.engage();
    if (requests.device || requests.restart || requests.replayDemonstration) grab_.reset();
    const auto turn = [](bool wanted, bool& folded) {
        if (!wanted) return;
        folded = !folded;
        ImGui::MarkIniSettingsDirty();
    };
    turn(requests.fold.left, sizes_.folded.left);
    turn(requests.fold.right, sizes_.folded.right);
    turn(requests.fold.bottom, sizes_.folded.bottom);
    if (requests.quit) window_.close();
}

}  // namespace touchstone::sandbox
