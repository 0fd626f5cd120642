#include "engine/ui/widgets.hpp"

#include <imgui_internal.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace touchstone::engine {

void noteItem(ItemRects* rects, std::string_view name) {
    if (!rects) return;
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
    (*rects)[std::string(name)] = {low.x, low.y, high.x, high.y};
}

bool closeList() {
    const ImGuiContext& context = *ImGui::GetCurrentContext();
    if (context.OpenPopupStack.empty()) return false;
    const ImGuiWindow* top = context.OpenPopupStack.back().Window;
    const std::string_view name = top ? top->Name : "";
    // ImGui's own names for them; those of dialogs differ.
    if (!name.starts_with("##Combo_") && !name.starts_with("##Menu_")) return false;
    ImGui::ClosePopupToLevel(context.OpenPopupStack.Size - 1, true);
    return true;
}

bool drawSlider(const Slider& slider, double& value, ItemRects* rects, std::string_view name) {
    ImGui::PushID(slider.label);
    if (!std::string_view(slider.label).starts_with("##")) {
        ImGui::TextUnformatted(slider.label);
        tooltip(slider.help);
    }
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), slider.format, value);
    ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(text.data()).x);
    ImGui::TextUnformatted(text.data());
    noteItem(rects, std::string(name) + " value");
    tooltip(slider.help);

    const ImGuiStyle& style = ImGui::GetStyle();
    ImGui::SetCursorPosY(ImGui::GetCursorPosY() - style.ItemSpacing.y + 0.1f * ImGui::GetFontSize());
    ImGui::SetNextItemWidth(-1);
    const bool typing = ImGui::TempInputIsActive(ImGui::GetID("##slider"));
    if (!typing) {  // a low bar without text
        ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {style.FramePadding.x, -0.12f * ImGui::GetFontSize()});
        ImGui::PushStyleColor(ImGuiCol_Text, {0, 0, 0, 0});
    }
    const bool changed = ImGui::SliderScalar(
        "##slider", ImGuiDataType_Double, &value, &slider.low, &slider.high, slider.format,
        (slider.logarithmic ? ImGuiSliderFlags_Logarithmic : 0) | (slider.typed ? 0 : ImGuiSliderFlags_NoInput));
    if (!typing) {
        ImGui::PopStyleColor();
        ImGui::PopStyleVar();
    }
    noteItem(rects, name);
    tooltip(slider.help);
    ImGui::PopID();
    return changed;
}

void drawTriple(const char* label, const char* unit, glm::dvec3& values, float speed, const char* help,
                ItemRects* rects, std::string_view name) {
    constexpr std::array kAxes{"x", "y", "z"};
    constexpr float kBetween = 4;  // screen units
    ImGui::PushID(label);
    ImGui::TextUnformatted(label);
    ImGui::SameLine();
    ImGui::TextDisabled("[%s]", unit);
    tooltip(help);
    ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {0, ImGui::GetStyle().FramePadding.y});
    ImGui::BeginGroup();
    const float width = std::floor((ImGui::GetContentRegionAvail().x - 2 * kBetween) / 3);
    for (int axis = 0; axis < 3; ++axis) {
        // As many decimals as the field has room for.
        const double size = std::abs(values[axis]);
        const std::string format = std::string(kAxes[std::size_t(axis)]) + (size < 100 ? " %.2f" : " %.1f");
        if (axis > 0) ImGui::SameLine(0, kBetween);
        ImGui::SetNextItemWidth(width);
        ImGui::PushID(axis);
        ImGui::DragScalar("##value", ImGuiDataType_Double, &values[axis], speed, nullptr, nullptr, format.c_str());
        ImGui::PopID();
    }
    ImGui::EndGroup();
    ImGui::PopStyleVar();
    noteItem(rects, name);
    tooltip(help);
    ImGui::PopID();
}

void tooltip(std::string_view text) {
    if (!ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) return;
    const float em = ImGui::GetFontSize(), wrap = 22 * em, gap = 0.3f * em;
    // Below the item, which it would hide at the mouse; above it where there is no room.
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax(), pad = ImGui::GetStyle().WindowPadding;
    const ImVec2 lines = ImGui::CalcTextSize(text.data(), text.data() + text.size(), false, wrap);
    const ImVec2 size{lines.x + 2 * pad.x, lines.y + 2 * pad.y}, window = ImGui::GetMainViewport()->Size;
    const bool below = high.y + gap + size.y <= window.y;
    if (below || low.y - gap - size.y >= 0)
        ImGui::SetNextWindowPos({std::clamp(ImGui::GetMousePos().x, 0.f, std::max(window.x - size.x, 0.f)),
                                 below ? high.y + gap : low.y - gap - size.y});
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(wrap);
    ImGui::TextUnformatted(text.data(), text.data() + text.size());
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
}

}  // namespace touchstone::engine
