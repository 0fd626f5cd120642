#include "engine/ui/panel_layout.hpp"

#include <imgui_internal.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>

namespace touchstone::engine {
namespace {

constexpr float kMinWidth = 12, kMinHeight = 5;  // of a panel, in font sizes
constexpr float kStrip = 1.5f;                   // width of a folded panel, in font sizes
constexpr const char* kIniName = "Touchstone";

PanelSizes& sizesOf(ImGuiSettingsHandler* handler) { return *static_cast<PanelSizes*>(handler->UserData); }

/// Draws a splitter and returns its displacement in this frame.
float drawSplitter(const char* id, ImVec2 position, ImVec2 size, bool vertical) {
    ImGui::SetNextWindowPos(position);
    ImGui::SetNextWindowSize(size);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0, 0});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, {1, 1});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
    ImGui::Begin(id, nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav | ImGuiWindowFlags_NoFocusOnAppearing |
                     ImGuiWindowFlags_NoBringToFrontOnFocus);
    ImGui::InvisibleButton("edge", size);
    const bool held = ImGui::IsItemActive();
    if (held || ImGui::IsItemHovered()) {
        ImGui::SetMouseCursor(vertical ? ImGuiMouseCursor_ResizeEW : ImGuiMouseCursor_ResizeNS);
        ImGui::GetWindowDrawList()->AddRectFilled(position, {position.x + size.x, position.y + size.y},
                                                  ImGui::GetColorU32(ImGuiCol_SliderGrab, held ? 1.f : 0.5f));
    }
    ImGui::End();
    ImGui::PopStyleVar(3);
    return !held ? 0 : vertical ? ImGui::GetIO().MouseDelta.x : ImGui::GetIO().MouseDelta.y;
}

/// Draws an arrow that is a button without a frame.
bool drawArrow(ImGuiDir direction, ImVec2 size) {
    ImGui::PushStyleColor(ImGuiCol_Button, {0, 0, 0, 0});
    const bool pressed = ImGui::ArrowButtonEx("##arrow", direction, size);
    ImGui::PopStyleColor();
    return pressed;
}

}  // namespace

void PanelSizes::remember() {
    ImGuiSettingsHandler handler;
    handler.TypeName = kIniName;
    handler.TypeHash = ImHashStr(kIniName);
    handler.UserData = this;
    handler.ReadOpenFn = [](ImGuiContext*, ImGuiSettingsHandler* h, const char*) -> void* { return h->UserData; };
    handler.ReadLineFn = [](ImGuiContext*, ImGuiSettingsHandler* h, void*, const char* line) {
        PanelSizes& sizes = sizesOf(h);
        PanelSizes read = sizes;
        // Clamp all values from the file, so that every panel stays visible. NaN becomes the lower bound.
        const auto within = [](float v, float low, float high) { return v > low ? std::min(v, high) : low; };
        if (std::sscanf(line, "Panels=%f,%f,%f,%f", &read.left, &read.right, &read.bottom, &read.haptics) == 4)
            sizes = {.left = within(read.left, kMinWidth, 60),
                     .right = within(read.right, kMinWidth, 80),
                     .bottom = within(read.bottom, kMinHeight, 40),
                     .haptics = within(read.haptics, 0.1f, 0.9f),
                     .folded = sizes.folded,
                     .window = sizes.window};
        if (glm::ivec3 on{0}; std::sscanf(line, "Folded=%d,%d,%d", &on.x, &on.y, &on.z) == 3)
            sizes.folded = {on.x != 0, on.y != 0, on.z != 0};
        if (std::sscanf(line, "Size=%d,%d", &read.window.x, &read.window.y) == 2)
            sizes.window = glm::clamp(read.window, glm::ivec2(640, 400), glm::ivec2(16384));
    };
    handler.WriteAllFn = [](ImGuiContext*, ImGuiSettingsHandler* h, ImGuiTextBuffer* out) {
        const PanelSizes& s = sizesOf(h);
        out->appendf("[%s][Window]\nPanels=%.2f,%.2f,%.2f,%.4f\nFolded=%d,%d,%d\nSize=%d,%d\n\n", kIniName,
                     double(s.left), double(s.right), double(s.bottom), double(s.haptics), s.folded.left,
                     s.folded.right, s.folded.bottom, s.window.x, s.window.y);
    };
    ImGui::GetCurrentContext()->SettingsHandlers.push_back(handler);
}

void PanelSizes::keepWindow(glm::ivec2 size) {
    if (size == window) return;
    window = size;
    ImGui::MarkIniSettingsDirty();
}

Layout::Layout(glm::vec2 window, float top, float em, const PanelSizes& sizes, bool panels) {
    const auto size = [&](bool folded, float wanted, float most) {
        return !panels ? 0 : folded ? kStrip * em : std::min(wanted * em, most);
    };
    const float left = size(sizes.folded.left, sizes.left, 0.35f * window.x);
    const float right = size(sizes.folded.right, sizes.right, 0.45f * window.x);
    const float bottom = size(sizes.folded.bottom, sizes.bottom, 0.5f * window.y);
    const float height = std::max(window.y - top, 1.f);
    const float hapticsHeight = std::clamp(sizes.haptics, 0.1f, 0.9f) * height;
    scene = {{0, top}, {left, height - hapticsHeight}};
    haptics = {{0, top + height - hapticsHeight}, {left, hapticsHeight}};
    plots = {{window.x - right, top}, {right, height}};
    picture = {{left, top}, {std::max(window.x - left - right, 1.f), std::max(height - bottom, 1.f)}};
    log = {{left, window.y - bottom}, {picture.size.x, bottom}};
}

void drawSplitters(const Layout& layout, float em, PanelSizes& sizes) {
    const float width = 0.4f * em, half = 0.5f * width;
    const Area& picture = layout.picture;
    const float bottom = layout.log.position.y, height = layout.plots.size.y;
    const Folds& folded = sizes.folded;
    const auto edge = [&](bool hidden, const char* id, ImVec2 position, ImVec2 size, bool vertical) {
        return hidden ? 0 : drawSplitter(id, position, size, vertical);
    };
    const float left =
        edge(folded.left, "##left edge", {picture.position.x - half, picture.position.y}, {width, height}, true);
    const float right =
        edge(folded.right, "##right edge", {layout.plots.position.x - half, picture.position.y}, {width, height}, true);
    const float low =
        edge(folded.bottom, "##bottom edge", {picture.position.x, bottom - half}, {picture.size.x, width}, false);
    const float haptics = edge(folded.left, "##haptics edge", {0, layout.haptics.position.y - half},
                               {layout.haptics.size.x, width}, false);
    if (left == 0 && right == 0 && low == 0 && haptics == 0) return;
    // Start from the drawn edges, since a small window may show smaller panels than the stored sizes.
    if (left != 0) sizes.left = std::max((layout.scene.size.x + left) / em, kMinWidth);
    if (right != 0) sizes.right = std::max((layout.plots.size.x - right) / em, kMinWidth);
    if (low != 0) sizes.bottom = std::max((layout.log.size.y - low) / em, kMinHeight);
    if (haptics != 0) sizes.haptics = std::clamp((layout.haptics.size.y - haptics) / height, 0.1f, 0.9f);
    ImGui::MarkIniSettingsDirty();
}

bool drawFoldButton(const Fold& fold, ItemRects* rects) {
    const ImRect bar = ImGui::GetCurrentWindow()->TitleBarRect();
    const ImVec2 cursor = ImGui::GetCursorPos();
    const float size = bar.GetHeight();
    ImGui::PushClipRect(bar.Min, bar.Max, false);
    ImGui::SetCursorScreenPos({bar.Max.x - size, bar.Min.y});
    const bool pressed = drawArrow(fold.outward, {size, size});
    noteItem(rects, std::string("fold ") + fold.name);
    tooltip(std::string("Folds this panel away.\n") + fold.help);
    ImGui::PopClipRect();
    ImGui::SetCursorPos(cursor);
    return pressed;
}

bool drawFolded(const Fold& fold, const Area& area, ItemRects* rects) {
    ImGui::SetNextWindowPos(area.position);
    ImGui::SetNextWindowSize(area.size);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0, 0});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, {1, 1});
    ImGui::Begin((std::string("##folded ") + fold.name).c_str(), nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                     ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoBringToFrontOnFocus);
    constexpr std::array kInward{ImGuiDir_Right, ImGuiDir_Left, ImGuiDir_Down, ImGuiDir_Up};
    const bool pressed = drawArrow(kInward[static_cast<std::size_t>(fold.outward)], area.size);
    noteItem(rects, std::string("unfold ") + fold.name);
    tooltip(std::string("Unfolds the ") + fold.name + ".\n" + fold.help);
    ImGui::End();
    ImGui::PopStyleVar(3);
    return pressed;
}

}  // namespace touchstone::engine
