#include "engine/ui/widgets.hpp"

#include <imgui.h>

namespace touchstone::engine {

void noteItem(ItemRects* rects, std::string_view name) {
    if (!rects) return;
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
    (*rects)[std::string(name)] = {low.x, low.y, high.x, high.y};
}

void tooltip(std::string_view text) {
    if (!ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) return;
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(22 * ImGui::GetFontSize());
    ImGui::TextUnformatted(text.data(), text.data() + text.size());
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
}

}  // namespace touchstone::engine
