#include <imgui.h>

#include <algorithm>
#include <utility>

#include "haptics/sandbox/app/app.hpp"
#include "haptics/sandbox/app/panel_demonstration.hpp"
#include "haptics/sandbox/session/device_choice.hpp"

namespace touchstone::sandbox {
namespace {

constexpr double kMessageSeconds = 8;  // s: display time of a warning over the picture

bool beginPanel(const char* title, const engine::Area& area) {
    ImGui::SetNextWindowPos(area.position);
    ImGui::SetNextWindowSize(area.size);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {ImGui::GetStyle().ItemSpacing.x, 4});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0.5f * ImGui::GetFontSize(), 0.5f * ImGui::GetFontSize()});
    return ImGui::Begin(title, nullptr,
                        ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                            ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus |
                            ImGuiWindowFlags_NoFocusOnAppearing);
}

void endPanel() {
    ImGui::End();
    ImGui::PopStyleVar(3);
}

}  // namespace

void App::drawPanels(const engine::Layout& layout) {
    const std::string& device = session_.device().choice;
    const MenuView menu{.scenes = scenes_,
                        .recent = recent_.list(),
                        .file = session_.request().file,
                        .device = device,
                        .running = session_.running() && !options_.study,  // the study has device, goal and motion
                        .hasScene = viewed_ != nullptr,
                        .hasDemonstration = viewed_ && viewed_->demonstration,
                        .hasSelection = bool(selection_.node()),
                        .canUndo = !options_.study && undo_.canUndo(),
                        .canRedo = !options_.study && undo_.canRedo(),
                        .recording = session_.recording().recorder() != nullptr,
                        .folded = sizes_.folded};
    const bool wasOpen = menu_.openDialog;
    drawMenuBar(menu, menu_, display_, requests_, &items_);
    if (menu_.openDialog && !wasOpen) scenes_ = engine::findScenes(options_.sceneFolders);

    if (menu_.panels) {
        // Draws the first panel of a group that folds, or the strip of the folded group. Returns whether it is open.
        const auto draw = [&](const char* title, const engine::Area& area, const engine::Fold& fold, bool folded,
                              bool& request, auto&& content) {
            if (folded) {
                request |= engine::drawFolded(fold, area, &items_);
                return false;
            }
            const bool open = beginPanel(title, area);
            request |= engine::drawFoldButton(fold, &items_);
            if (open) content();
            endPanel();
            return true;
        };
        const engine::Folds folded = sizes_.folded;
        const engine::Area left{layout.scene.position, {layout.scene.size.x, layout.plots.size.y}};
        const auto drawScene = [&] {
            if (!viewed_) return ImGui::TextDisabled("No scene is open.");
            const MotionRecorder* recorder = session_.demonstration();
            if (!options_.study)
                drawDemonstration({.running = session_.running(),
                                   .hasDemonstration = viewed_->demonstration != nullptr,
                                   .hasGoal = viewed_->roles.goal.has_value(),
                                   .recordedMs = recorder ? std::optional(recorder->duration()) : std::nullopt},
                                  requests_, &items_);
            scenePanel_.selected = selection_.node();
            drawScenePanel(*viewed_, geometryOf(session_.settings()), display_, scenePanel_, &items_);
            selection_.select(scenePanel_.selected);
        };
        if (draw("Scene", folded.left ? left : layout.scene, {"scene and its settings", ImGuiDir_Left, "Key F2"},
                 folded.left, requests_.fold.left, drawScene)) {
            if (beginPanel("Haptics", layout.haptics)) drawLeftPanel();
            endPanel();
        }
        draw("Plots", layout.plots, {"plots", ImGuiDir_Right, "Key F3"}, folded.right, requests_.fold.right,
             [&] { measure_.draw(session_, &items_); });
        draw("Log", layout.log, {"log", ImGuiDir_Down, "Key F4"}, folded.bottom, requests_.fold.bottom,
             [&] { drawLogPanel(session_.log().messages(), &items_); });
        engine::drawSplitters(layout, ImGui::GetFontSize(), sizes_);
    }
    drawBar();
    drawGuideWindow(layout.picture);
    drawHints(layout.picture);
    if (options_.panel) {
        const ImVec2 low = layout.picture.position, size = layout.picture.size;
        options_.panel(session_, {low.x, low.y, low.x + size.x, low.y + size.y}, items_);
    }
    openDialog_.draw(menu, menu_, requests_, &items_);
    drawDialogs(menu, menu_, requests_, &items_);
    if (const auto progress = session_.opening()) drawOpening(*progress, requests_, &items_);
}

/// Draws the status bar, which is shown even when the panels are hidden.
void App::drawBar() {
    const float height = statusBarHeight();
    const glm::vec2 window = window_.size();
    ImGui::SetNextWindowPos({0, window.y - height});
    ImGui::SetNextWindowSize({window.x, height});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0.6f * ImGui::GetFontSize(), 0.2f * ImGui::GetFontSize()});
    ImGui::Begin("Health", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                     ImGuiWindowFlags_NoFocusOnAppearing);
    const Gauge* gauge = viewed_ && viewed_->roles.gauge ? &*viewed_->roles.gauge : nullptr;
    if (drawStatusBar({session_.snapshot(), session_.realTime(), session_.device().choice, session_.device().facts,
                       shownCost_, session_.recording().recorder(), gauge},
                      &items_))
        requests_.stopOrEngage = true;
    ImGui::End();
    ImGui::PopStyleVar(2);
}

/// Draws hints over the picture: how to use the mouse, until the tool was first held, and the newest warning.
void App::drawHints(const engine::Area& picture) const {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const float em = ImGui::GetFontSize(), width = picture.size.x - 4 * em;
    const auto write = [&](const std::string& text, const ImVec4& color, bool below) {
        const ImVec2 size = ImGui::CalcTextSize(text.c_str(), nullptr, false, width);
        const ImVec2 at{picture.position.x + 0.5f * (picture.size.x - size.x),
                        picture.position.y + (below ? picture.size.y - size.y - em : em)};
        list.AddRectFilled({at.x - 0.5f * em, at.y - 0.4f * em}, {at.x + size.x + 0.5f * em, at.y + size.y + 0.4f * em},
                           ImGui::GetColorU32(ImGuiCol_PopupBg, 0.9f), 0.3f * em);
        list.AddText(nullptr, 0, at, ImGui::GetColorU32(color), text.c_str(), nullptr, width);
    };
    if (session_.running() && session_.snapshot()->finished && traitsOf(session_.device().choice).followsMotion)
        write("The motion has ended: R runs it again, or drag the tool.", ImGui::GetStyleColorVec4(ImGuiCol_Text),
              true);
    else if (session_.running() && !everHeld_)
        write("Drag the tool: left button moves it, right button turns it. Press F1 for help.",
              ImGui::GetStyleColorVec4(ImGuiCol_Text), true);
    const auto& messages = session_.log().messages();
    const auto warning = std::find_if(messages.rbegin(), messages.rend(),
                                      [](const Message& m) { return m.kind != Message::Kind::Note; });
    if (warning == messages.rend() || session_.log().seconds() - warning->seconds > kMessageSeconds) return;
    const bool error = warning->kind == Message::Kind::Error;
    write(warning->text, error ? ImVec4(1, 0.5f, 0.45f, 1) : ImVec4(1, 0.8f, 0.4f, 1), false);
}

/// Draws the settings, with additional pages for a hardware device and for the selected
/// node.
void App::drawLeftPanel() {
    const auto drawSettings = [&] {
        Settings settings = session_.settings();
        const Settings& scene = viewed_ ? viewed_->settings : settings;
        if (drawHapticsPanel(scene, measure_.fit(session_), settings, hapticsPanel_, requests_, &items_))
            session_.setSettings(settings);
    };
    const engine::Entity node = selection_.node();
    const bool isNew = node != pageNode_;
    pageNode_ = node;
    const bool selected = viewed_ && viewed_->scene.registry.alive(node) && !options_.study;
    const bool device = session_.device().control.get() || !session_.device().trouble.empty();
    const std::string hardware = device ? session_.device().choice + session_.device().trouble : "";
    const bool isNewDevice = hardware != std::exchange(pageDevice_, hardware);
    if (!device && options_.study) {
        ImGui::TextWrapped("The study sets all settings.");
        return;
    }
    if (!selected && !device) {
        drawSettings();
        return;
    }
    if (!ImGui::BeginTabBar("pages")) return;
    if (!options_.study && ImGui::BeginTabItem("Settings")) {
        drawSettings();
        ImGui::EndTabItem();
    }
    if (!options_.study) engine::noteItem(&items_, "page settings");
    if (device &&
        ImGui::BeginTabItem("Device", nullptr, isNewDevice ? ImGuiTabItemFlags_SetSelected : ImGuiTabItemFlags_None)) {
        drawDevicePanel({session_.device().choice, session_.device().facts, session_.settings(),
                         session_.device().control.get(), session_.device().trouble},
                        devicePanel_, requests_, &items_);
        ImGui::EndTabItem();
    }
    if (device) engine::noteItem(&items_, "page device");
    if (selected &&
        ImGui::BeginTabItem("Selected", nullptr, isNew ? ImGuiTabItemFlags_SetSelected : ImGuiTabItemFlags_None)) {
        drawInspector(*viewed_, geometryOf(session_.settings()), node, inspector_, requests_, &items_);
        ImGui::EndTabItem();
    }
    if (selected) engine::noteItem(&items_, "page selected");
    ImGui::EndTabBar();
}

bool App::asksUnit() const { return viewed_->unit && sizeKept_ != session_.sceneNumber(); }

/// The width that the guide takes from the picture; 0 while there is none.
float App::guideWidth() const {
    if (!viewed_ || session_.opening() || (viewed_->missing.empty() && !asksUnit())) return 0;
    return 19 * ImGui::GetFontSize();
}

void App::drawGuideWindow(const engine::Area& picture) {
    const float width = guideWidth();
    if (width == 0) return;
    const float em = ImGui::GetFontSize();
    ImGui::SetNextWindowPos({picture.position.x + 0.7f * em, picture.position.y + 0.7f * em});
    ImGui::SetNextWindowSize({width - em, 0});
    ImGui::Begin("Roles", nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing);
    if (!viewed_->missing.empty()) drawGuide(*viewed_, selection_.node(), requests_, &items_);
    if (asksUnit() && drawUnitQuestion(*viewed_, *viewed_->unit, requests_, &items_))
        sizeKept_ = session_.sceneNumber();
    ImGui::End();
}

}  // namespace touchstone::sandbox
