#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>
#include <utility>
#include <vector>

#include "haptics/device/device_table.hpp"
#include "haptics/sandbox/devices/all_devices.hpp"
#include "haptics/sandbox/panels/panels.hpp"
#include "haptics/sandbox/scene/tree_words.hpp"

namespace touchstone::sandbox {

bool beginDialog(const char* title, bool& open) {
    if (open) ImGui::OpenPopup(title);
    open = false;
    ImGui::SetNextWindowPos(ImGui::GetMainViewport()->GetCenter(), ImGuiCond_Always, {0.5f, 0.5f});
    if (!ImGui::BeginPopup(title, ImGuiWindowFlags_NoMove)) return false;
    if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape), false)) ImGui::CloseCurrentPopup();
    ImGui::TextUnformatted(title);
    ImGui::Separator();
    return true;
}

namespace {

constexpr const char *kReplayTitle = "Replay a motion", *kHelpTitle = "Mouse and keyboard",
                     *kSaveTitle = "Save the scene", *kAddTitle = "Add a part", *kLeaveTitle = "Unsaved changes",
                     *kStudyTitle = "Make a study";

/// Draws a text field for a path with two buttons below it. Returns true when the path was confirmed.
bool drawPathInput(const char* id, PathInput& path, const char* action, engine::ItemRects* items) {
    ImGui::SetNextItemWidth(36 * ImGui::GetFontSize());
    bool confirmed = ImGui::InputText(id, path.data(), path.size(), ImGuiInputTextFlags_EnterReturnsTrue);
    engine::noteItem(items, id);
    confirmed |= ImGui::Button(action);
    engine::noteItem(items, action);
    ImGui::SameLine();
    if (ImGui::Button("Cancel")) ImGui::CloseCurrentPopup();
    confirmed &= path[0] != '\0';
    if (confirmed) ImGui::CloseCurrentPopup();
    return confirmed;
}

void drawReplayDialog(MenuState& state, PanelRequests& requests, engine::ItemRects* items) {
    if (!beginDialog(kReplayTitle, state.replayDialog)) return;
    ImGui::TextDisabled("Folder of a recording, or CSV file with the columns t_ms,x_mm,y_mm,z_mm,qw,qx,qy,qz.");
    if (drawPathInput("##replay path", state.replayPath, "Replay", items))
        requests.device = "replay:" + std::string(state.replayPath.data());
    ImGui::EndPopup();
}

void drawSaveDialog(const MenuView& view, MenuState& state, PanelRequests& requests, engine::ItemRects* items) {
    if (state.saveDialog) std::snprintf(state.savePath.data(), state.savePath.size(), "%s", view.file.string().c_str());
    if (!beginDialog(kSaveTitle, state.saveDialog)) return;
    ImGui::TextDisabled(
        "Saves roles, poses, goal, demonstration, trees, materials and parts. All other content of the file is kept.");
    ImGui::Checkbox("Include current settings", &state.saveSettings);
    engine::noteItem(items, "save settings");
    engine::tooltip("The saved scene starts with these settings.");
    if (drawPathInput("##save path", state.savePath, "Save", items)) {
        requests.save = state.savePath.data();
        requests.saveSettings = state.saveSettings;
    }
    ImGui::EndPopup();
}

void drawAddDialog(MenuState& state, PanelRequests& requests, engine::ItemRects* items) {
    if (!beginDialog(kAddTitle, state.addDialog)) return;
    ImGui::TextDisabled("Adds all meshes of a .glb or .gltf file as one body, at their poses in that file.");
    for (const Role role : {Role::Tool, Role::Obstacle}) {
        if (role != Role::Tool) ImGui::SameLine();
        if (ImGui::RadioButton(name(role), state.addRole == role)) state.addRole = role;
        engine::noteItem(items, std::string("add ") + name(role));
    }
    if (drawPathInput("##add path", state.addPath, "Add", items))
        requests.markings = {AddBody{state.addPath.data(), state.addRole}};
    ImGui::EndPopup();
}

void drawStudyDialog(const MenuView& view, MenuState& state, PanelRequests& requests, engine::ItemRects* items) {
    if (state.studyDialog)
        std::snprintf(state.studyPath.data(), state.studyPath.size(), "%s",
                      std::filesystem::absolute(view.file.stem().string() + "-study").c_str());
    if (!beginDialog(kStudyTitle, state.studyDialog)) return;
    ImGui::TextDisabled(
        "Makes a folder with this scene and a study in which five simulated hands put the tool into its goal.");
    if (drawPathInput("##study path", state.studyPath, "Make", items)) requests.study = state.studyPath.data();
    ImGui::EndPopup();
}

void drawLeaveDialog(const MenuView& view, MenuState& state, PanelRequests& requests, engine::ItemRects* items) {
    if (!beginDialog(kLeaveTitle, state.leaveDialog)) return;
    ImGui::Text("The scene has changes that are not saved in %s.", view.file.filename().c_str());
    const auto button = [&](const char* label, const char* help) {
        const bool pressed = ImGui::Button(label);
        engine::noteItem(items, label);
        engine::tooltip(help);
        ImGui::SameLine();
        if (pressed) ImGui::CloseCurrentPopup();
        return pressed;
    };
    if (button("Save ...", "Opens the save dialog. Repeat your command after saving.")) state.saveDialog = true;
    if (button("Discard changes", state.leaving.reload ? "Ctrl+Z restores the changes." : "The changes are lost.")) {
        requests = state.leaving;
        requests.discard = true;
    }
    button("Cancel", "Keeps the scene as it is.");
    ImGui::EndPopup();
}

struct HelpRow {
    std::string what, does;
};
struct HelpGroup {
    const char* title;
    std::vector<HelpRow> rows;
};

std::array<std::vector<HelpGroup>, 2> helpColumns() {
    HelpGroup display{"Show or hide", {}};
    for (const DisplaySwitch& which : displaySwitches())
        display.rows.push_back({std::string(1, which.key), which.title});
    return {{{{"Tool",
               {{"Left drag on it", "move it in the view plane; the mouse replaces any other device"},
                {"Wheel, Page Up/Down while held", "move it away from you and back"},
                {"Right or Shift+left drag on it", "turn it; the wheel then turns it about the line of sight"},
                {"Arrows, comma, period while held", "turn it about the view's axes and the line of sight"},
                {"R", "reset device and tool to the start"},
                {"Space", "stop (zero force at once, the tool is held) or engage"}}},
              {"Selection",
               {{"Click", "select a part; on the background, clear the selection"},
                {"Drag a handle", "move or turn the part; with Ctrl in steps of 1 mm and 5°; Escape cancels"},
                {"E", "align the handles with the local axes or the scene axes"}}},
              {"View",
               {{"Left drag elsewhere", "orbit"},
                {"Right or middle drag elsewhere", "pan"},
                {"Wheel", "zoom toward the cursor"},
                {"F", "frame the selection, or everything if nothing is selected"},
                {"A, Home", "frame all"},
                {"Keypad 1, 3, 7", "front, right and top view; with Ctrl back, left and bottom"}}}},
             {{"Window",
               {{"F1, ?", "show or hide this help"},
                {"F2, F3, F4", "fold or unfold the scene and its settings, the plots, the log"},
                {"H", "show or hide the panels"},
                {"S", "swap rendering and shadow solver"},
                {"Ctrl+O, Ctrl+S", "open a scene, save the scene"},
                {"Ctrl+Z, Ctrl+Shift+Z", "undo and redo changes of settings and of the scene"},
                {"Ctrl+Shift+C", "copy the run as a command line"}}},
              display}}};
}

void drawHelpGroup(const HelpGroup& group) {
    ImGui::TextDisabled("%s", group.title);
    if (!ImGui::BeginTable(group.title, 2)) return;
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, 14.5f * ImGui::GetFontSize());
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch);
    for (const auto& [what, does] : group.rows) {
        ImGui::TableNextRow();
        ImGui::TableNextColumn();
        ImGui::TextUnformatted(what.c_str());
        ImGui::TableNextColumn();
        ImGui::TextWrapped("%s", does.c_str());
    }
    ImGui::EndTable();
    ImGui::Spacing();
}

void drawHelpDialog(MenuState& state, engine::ItemRects* items) {
    const bool close = ImGui::IsPopupOpen(kHelpTitle) && std::exchange(state.helpDialog, false);
    if (!beginDialog(kHelpTitle, state.helpDialog)) return;
    if (close) ImGui::CloseCurrentPopup();
    constexpr int kColumns = 2;
    if (ImGui::BeginTable("columns", kColumns)) {
        const float width =
            0.5f * std::min(82 * ImGui::GetFontSize(), ImGui::GetMainViewport()->Size.x) - 2 * ImGui::GetFontSize();
        for (int column = 0; column < kColumns; ++column)
            ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, width);
        for (const auto& groups : helpColumns()) {
            ImGui::TableNextColumn();
            for (const HelpGroup& group : groups) drawHelpGroup(group);
        }
        ImGui::EndTable();
    }
    if (ImGui::Button("Close")) ImGui::CloseCurrentPopup();
    engine::noteItem(items, "close help");
    ImGui::EndPopup();
}

void drawDeviceMenu(const MenuView& view, MenuState& state, PanelRequests& requests, engine::ItemRects* items) {
    const std::string current = view.device.substr(0, view.device.find(':'));
    for (const DeviceInfo& device : allDevices()) {
        const bool possible = view.running && (!device.traits.followsMotion || view.hasDemonstration);
        const std::string text(device.name);
        if (ImGui::MenuItem(text.c_str(), nullptr, current == device.name, possible)) {
            if (device.traits.followsFile)
                state.replayDialog = true;
            else
                requests.device = text;
        }
        engine::noteItem(items, "device " + text);
        engine::tooltip(device.summary);
    }
}

}  // namespace

void drawMenuBar(const MenuView& view, MenuState& state, DisplayOptions& display, PanelRequests& requests,
                 engine::ItemRects* items) {
    if (ImGui::BeginMainMenuBar()) {
        if (ImGui::BeginMenu("Scene")) {
            if (ImGui::MenuItem("Open ...", "Ctrl+O")) state.openDialog = true;
            engine::noteItem(items, "menu open");
            if (ImGui::MenuItem("Reload", nullptr, false, view.hasScene)) requests.reload = true;
            engine::noteItem(items, "menu reload");
            engine::tooltip("Reads the scene's file again.");
            if (ImGui::BeginMenu("Recent", !view.recent.empty())) {
                for (const std::filesystem::path& scene : view.recent)
                    if (ImGui::MenuItem(scene.c_str())) requests.open = scene;
                ImGui::EndMenu();
            }
            if (ImGui::MenuItem("Add a part ...", nullptr, false, view.hasScene)) state.addDialog = true;
            engine::noteItem(items, "menu add");
            if (ImGui::MenuItem("Save ...", "Ctrl+S", false, view.hasScene)) state.saveDialog = true;
            engine::noteItem(items, "menu save");
            if (ImGui::MenuItem("Study ...", nullptr, false, view.running)) state.studyDialog = true;
            engine::noteItem(items, "menu study");
            if (ImGui::MenuItem(view.recording ? "Stop recording" : "Record", nullptr, false,
                                view.running || view.recording))
                requests.record = true;
            engine::noteItem(items, "menu record");
            engine::tooltip(
                "Records every tick into a folder. The recording replays bit-reproducibly, and NumPy can read it.");
            ImGui::Separator();
            for (const std::filesystem::path& scene : view.scenes)
                if (ImGui::MenuItem(scene.stem().c_str())) requests.open = scene;
            if (!view.scenes.empty()) ImGui::Separator();
            if (ImGui::MenuItem("Quit", "Ctrl+Q")) requests.quit = true;
            ImGui::EndMenu();
        }
        engine::noteItem(items, "menu scene");
        if (ImGui::BeginMenu("Edit")) {
            if (ImGui::MenuItem("Undo", "Ctrl+Z", false, view.canUndo)) requests.undo = true;
            engine::noteItem(items, "menu undo");
            if (ImGui::MenuItem("Redo", "Ctrl+Shift+Z", false, view.canRedo)) requests.redo = true;
            ImGui::Separator();
            if (ImGui::MenuItem("Set goal here", nullptr, false, view.running)) requests.setGoal = true;
            engine::noteItem(items, "menu set goal");
            if (ImGui::MenuItem(view.recordingDemonstration ? "Finish demonstration" : "Record demonstration", nullptr,
                                false, view.running || view.recordingDemonstration))
                requests.recordDemonstration = true;
            if (ImGui::MenuItem("Replay demonstration", nullptr, false,
                                view.running && view.hasDemonstration && !view.recordingDemonstration))
                requests.replayDemonstration = true;
            ImGui::Separator();
            if (ImGui::MenuItem("Copy as command line", "Ctrl+Shift+C", false, view.running))
                requests.copyCommand = true;
            ImGui::EndMenu();
        }
        engine::noteItem(items, "menu edit");
        if (ImGui::BeginMenu("Device")) {
            drawDeviceMenu(view, state, requests, items);
            ImGui::EndMenu();
        }
        engine::noteItem(items, "menu device");
        if (ImGui::BeginMenu("View")) {
            ImGui::MenuItem("Panels", "H", &state.panels);
            if (ImGui::MenuItem("Scene and haptics", "F2", !view.folded.left)) requests.fold.left = true;
            if (ImGui::MenuItem("Plots", "F3", !view.folded.right)) requests.fold.right = true;
            if (ImGui::MenuItem("Log", "F4", !view.folded.bottom)) requests.fold.bottom = true;
            ImGui::Separator();
            if (ImGui::MenuItem("Frame all", "A")) requests.frameCamera = true;
            if (ImGui::MenuItem("Frame selected", "F", false, view.hasSelection)) requests.frameSelection = true;
            ImGui::Separator();
            const struct {
                const char *text, *key;
                engine::StandardView view;
            } sides[]{{"Front", "Keypad 1", engine::StandardView::Front},
                      {"Back", "Ctrl+Keypad 1", engine::StandardView::Back},
                      {"Right", "Keypad 3", engine::StandardView::Right},
                      {"Left", "Ctrl+Keypad 3", engine::StandardView::Left},
                      {"Top", "Keypad 7", engine::StandardView::Top},
                      {"Bottom", "Ctrl+Keypad 7", engine::StandardView::Bottom}};
            for (const auto& side : sides)
                if (ImGui::MenuItem(side.text, side.key)) requests.view = side.view;
            ImGui::Separator();
            for (const DisplaySwitch& which : displaySwitches()) {
                const bool on = isOn(display, which);
                const char key[]{which.key, '\0'};
                if (ImGui::MenuItem(which.title, key, on)) turn(display, which, !on);
                engine::tooltip(which.help);
            }
            ImGui::EndMenu();
        }
        engine::noteItem(items, "menu view");
        if (ImGui::MenuItem("Help")) state.helpDialog = true;
        engine::noteItem(items, "menu help");
        ImGui::EndMainMenuBar();
    }
}

void drawDialogs(const MenuView& view, MenuState& state, PanelRequests& requests, engine::ItemRects* items) {
    drawSaveDialog(view, state, requests, items);
    drawAddDialog(state, requests, items);
    drawStudyDialog(view, state, requests, items);
    drawReplayDialog(state, requests, items);
    drawLeaveDialog(view, state, requests, items);
    drawHelpDialog(state, items);
}

void drawOpening(const OpeningProgress& progress, PanelRequests& requests, engine::ItemRects* items) {
    const float em = ImGui::GetFontSize();
    ImGui::SetNextWindowPos(ImGui::GetMainViewport()->GetCenter(), ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowSize({26 * em, 0});
    ImGui::Begin("Opening", nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings);
    ImGui::Text("Opening %s", progress.file.c_str());
    const std::string what = !progress.reading.empty() ? "STEP: " + progress.reading
                             : progress.fraction >= 1  ? "Starting"
                             : progress.part.empty()   ? "Reading the file"
                                                       : "Building the sphere tree of " + progress.part;
    std::string bar = std::to_string(static_cast<int>(100 * progress.fraction)) + " %";
    if (const std::string left = timeLeft(progress.secondsLeft); !left.empty()) bar += ", " + left;
    ImGui::ProgressBar(static_cast<float>(progress.fraction), {-1, 0}, bar.c_str());
    ImGui::TextDisabled("%s", what.c_str());
    ImGui::SameLine(ImGui::GetContentRegionMax().x - 5 * em);
    if (ImGui::Button("Cancel", {5 * em, 0})) requests.cancelOpening = true;
    engine::noteItem(items, "cancel opening");
    ImGui::End();
}

}  // namespace touchstone::sandbox
