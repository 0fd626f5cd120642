#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "haptics/sandbox/panels/panels.hpp"

namespace touchstone::sandbox {
namespace {

const ImVec4 kWarning{1.00f, 0.78f, 0.35f, 1}, kError{1.00f, 0.48f, 0.42f, 1};

std::string asText(const std::vector<Message>& messages) {
    constexpr std::array kKinds{"", "warning: ", "error: "};
    std::string text;
    for (const Message& message : messages) {
        std::array<char, 24> time{};
        std::snprintf(time.data(), time.size(), "%7.1f s  ", message.seconds);
        text += time.data() + std::string(kKinds[static_cast<std::size_t>(message.kind)]) + message.text + "\n";
    }
    return text;
}

}  // namespace

void drawLogPanel(const std::vector<Message>& messages, engine::ItemRects* items) {
    // Whole lines only: no space between messages, a height and a scroll position in lines.
    const float em = ImGui::GetFontSize(), line = ImGui::GetTextLineHeight();
    const float lines = std::max(std::floor(ImGui::GetContentRegionAvail().y / line), 1.f);
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {ImGui::GetStyle().ItemSpacing.x, 0});
    ImGui::BeginChild("messages", {ImGui::GetContentRegionAvail().x - 4.5f * em, lines * line});
    for (const Message& message : messages) {
        ImGui::TextDisabled("%.1f s", message.seconds);
        ImGui::SameLine(std::max(3.5f * em, ImGui::GetItemRectSize().x + 0.5f * em));
        ImGui::PushTextWrapPos(0);
        if (message.kind == Message::Kind::Note)
            ImGui::TextUnformatted(message.text.c_str());
        else
            ImGui::TextColored(message.kind == Message::Kind::Error ? kError : kWarning, "%s", message.text.c_str());
        ImGui::PopTextWrapPos();
    }
    engine::noteItem(items, "newest message");
    // Keep the newest message in view unless the user has scrolled back.
    const float scroll = ImGui::GetScrollY();
    if (scroll >= ImGui::GetScrollMaxY())
        ImGui::SetScrollHereY(1);
    else if (scroll != line * std::round(scroll / line))
        ImGui::SetScrollY(line * std::round(scroll / line));
    ImGui::EndChild();
    engine::noteItem(items, "messages");
    ImGui::PopStyleVar();
    ImGui::SameLine();
    if (ImGui::Button("Copy", {-1, 0})) ImGui::SetClipboardText(asText(messages).c_str());
    engine::noteItem(items, "copy log");
    engine::tooltip("Copies all messages to the clipboard.");
}

}  // namespace touchstone::sandbox
