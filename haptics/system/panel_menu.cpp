#include <imgui.h>

#include <algorithm>
#include <string_view>

#include "haptics/system/panels.hpp"
#include "haptics/system/tree_words.hpp"

namespace touchstone::system {
namespace {

constexpr const char *kOpenTitle = "Open a scene", *kReplayTitle = "Replay a motion", *kHelpTitle = "Mouse and keys";

/// A dialog in the middle of the window, opened on request and closed by a click beside it or Escape.
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

/// A path to type and the two buttons below it; true when it was confirmed.
bool drawPathInput(const char* id, PathInput& path, const char* action, ItemRects* items) {
    ImGui::SetNextItemWidth(36 * ImGui::GetFontSize());
    bool confirmed = ImGui::InputText(id, path.data(), path.size(), ImGuiInputTextFlags_EnterReturnsTrue);
    noteItem(items, id);
    confirmed |= ImGui::Button(action);
    noteItem(items, action);
    ImGui::SameLine();
    if (ImGui::Button("Cancel")) ImGui::CloseCurrentPopup();
    confirmed &= path[0] != '\0';
    if (confirmed) ImGui::CloseCurrentPopup();
    return confirmed;
}

void drawOpenDialog(const MenuView& view, MenuState& state, PanelRequests& requests, ItemRects* items) {
    if (!beginDialog(kOpenTitle, state.openDialog)) return;
    const auto rows = static_cast<float>(std::clamp(view.scenes.size(), std::size_t{2}, std::size_t{12}));
    ImGui::BeginChild("scenes", {36 * ImGui::GetFontSize(), (rows + 1) * ImGui::GetTextLineHeightWithSpacing()}, true);
    for (const std::filesystem::path& scene : view.scenes) {
        ImGui::PushID(scene.c_str());
        if (ImGui::Selectable(scene.stem().c_str())) {
            requests.open = scene;
            ImGui::CloseCurrentPopup();
        }
        noteItem(items, "open " + scene.stem().string());
        tooltip(scene.string());
        ImGui::PopID();
    }
    if (view.scenes.empty()) ImGui::TextDisabled("No scene was found.");
    ImGui::EndChild();
    ImGui::TextDisabled("Or a .glb or .gltf file; files can also be dropped on the window.");
    if (drawPathInput("##open path", state.openPath, "Open", items)) requests.open = state.openPath.data();
    ImGui::EndPopup();
}

void drawReplayDialog(MenuState& state, PanelRequests& requests, ItemRects* items) {
    if (!beginDialog(kReplayTitle, state.replayDialog)) return;
    ImGui::TextDisabled("A CSV file with the columns t_ms,x_mm,y_mm,z_mm,qw,qx,qy,qz.");
    if (drawPathInput("##replay path", state.replayPath, "Replay", items))
        requests.device = "replay:" + std::string(state.replayPath.data());
    ImGui::EndPopup();
}

void drawHelpDialog(MenuState& state) {
    if (!beginDialog(kHelpTitle, state.helpDialog)) return;
    const struct {
        const char *what, *does;
    } rows[]{
        {"Left button on the tool", "moves it in the view plane; the mouse takes over from any other device"},
        {"Wheel while it is held", "moves it away from you and back"},
        {"Right button, or Shift and left", "turns it; the wheel then turns it about the line of sight"},
        {"Left button elsewhere", "turns the view"},
        {"Right or middle button elsewhere", "shifts the view"},
        {"Wheel", "nearer and further"},
        {"Space", "pause and go on"},
        {"R", "reset: device and tool back to the start"},
        {"S", "swap rendering and shadow solver"},
        {"F", "bring everything into view"},
        {"H", "hide and show the panels"},
    };
    if (ImGui::BeginTable("keys", 2)) {
        ImGui::TableSetupColumn("what", ImGuiTableColumnFlags_WidthFixed);
        ImGui::TableSetupColumn("does", ImGuiTableColumnFlags_WidthFixed);
        for (const auto& [what, does] : rows) {
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            ImGui::TextUnformatted(what);
            ImGui::TableNextColumn();
            ImGui::TextUnformatted(does);
        }
        for (const DisplaySwitch& which : displaySwitches()) {
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            ImGui::Text("%c", which.key);
            ImGui::TableNextColumn();
            ImGui::Text("show or hide: %s", which.title);
        }
        ImGui::EndTable();
    }
    if (ImGui::Button("Close")) ImGui::CloseCurrentPopup();
    ImGui::EndPopup();
}

void drawDeviceMenu(const MenuView& view, MenuState& state, PanelRequests& requests, ItemRects* items) {
    const std::string current = view.device.substr(0, view.device.find(':'));
    for (const DeviceInfo& device : deviceTable()) {
        const bool possible = view.hasScene && (device.name != "demo" || view.hasDemonstration);
        const std::string text(device.name);
        if (ImGui::MenuItem(text.c_str(), nullptr, current == device.name, possible)) {
            if (device.name == "replay")
                state.replayDialog = true;
            else
                requests.device = text;
        }
        noteItem(items, "device " + text);
        tooltip(device.summary);
    }
}

}  // namespace

void drawMenuBar(const MenuView& view, MenuState& state, DisplayOptions& display, PanelRequests& requests,
                 ItemRects* items) {
    if (ImGui::BeginMainMenuBar()) {
        if (ImGui::BeginMenu("Scene")) {
            if (ImGui::MenuItem("Open ...", "Ctrl+O")) state.openDialog = true;
            noteItem(items, "menu open");
            if (ImGui::MenuItem("Open again", nullptr, false, view.hasScene)) requests.reload = true;
            ImGui::Separator();
            for (const std::filesystem::path& scene : view.scenes)
                if (ImGui::MenuItem(scene.stem().c_str())) requests.open = scene;
            if (!view.scenes.empty()) ImGui::Separator();
            if (ImGui::MenuItem("Quit", "Ctrl+Q")) requests.quit = true;
            ImGui::EndMenu();
        }
        noteItem(items, "menu scene");
        if (ImGui::BeginMenu("Device")) {
            drawDeviceMenu(view, state, requests, items);
            ImGui::EndMenu();
        }
        noteItem(items, "menu device");
        if (ImGui::BeginMenu("View")) {
            ImGui::MenuItem("Panels", "H", &state.panels);
            if (ImGui::MenuItem("Everything in view", "F")) requests.frameCamera = true;
            ImGui::Separator();
            for (const DisplaySwitch& which : displaySwitches()) {
                const bool on = isOn(display, which);
                const char key[]{which.key, '\0'};
                if (ImGui::MenuItem(which.title, key, on)) turn(display, which, !on);
                tooltip(which.help);
            }
            ImGui::EndMenu();
        }
        noteItem(items, "menu view");
        if (ImGui::MenuItem("Help")) state.helpDialog = true;
        noteItem(items, "menu help");
        ImGui::EndMainMenuBar();
    }
}

void drawDialogs(const MenuView& view, MenuState& state, PanelRequests& requests, ItemRects* items) {
    drawOpenDialog(view, state, requests, items);
    drawReplayDialog(state, requests, items);
    drawHelpDialog(state);
}

void drawOpening(const OpeningProgress& progress, PanelRequests& requests, ItemRects* items) {
    const float em = ImGui::GetFontSize();
    ImGui::SetNextWindowPos(ImGui::GetMainViewport()->GetCenter(), ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowSize({26 * em, 0});
    ImGui::Begin("Opening", nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings);
    ImGui::Text("Opening %s", progress.file.c_str());
    const std::string what = progress.fraction >= 1  ? "starting"
                             : progress.part.empty() ? "reading the file"
                                                     : "sphere tree of " + progress.part;
    std::string bar = std::to_string(static_cast<int>(100 * progress.fraction)) + " %";
    if (const std::string left = timeLeft(progress.secondsLeft); !left.empty()) bar += ", " + left;
    ImGui::ProgressBar(static_cast<float>(progress.fraction), {-1, 0}, bar.c_str());
    ImGui::TextDisabled("%s", what.c_str());
    ImGui::SameLine(ImGui::GetContentRegionMax().x - 5 * em);
    if (ImGui::Button("Cancel", {5 * em, 0})) requests.cancelOpening = true;
    noteItem(items, "cancel opening");
    ImGui::End();
}

}  // namespace touchstone::system
