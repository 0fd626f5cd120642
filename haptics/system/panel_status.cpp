#include <imgui.h>

#include "haptics/system/panels.hpp"

namespace touchstone::system {
namespace {

const ImVec4 kWarning{1.00f, 0.78f, 0.35f, 1}, kError{1.00f, 0.48f, 0.42f, 1};

}  // namespace

void drawStatusPanel(const std::vector<Message>& messages) {
    ImGui::BeginChild("messages");
    for (const Message& message : messages) {
        ImGui::TextDisabled("%6.1f s", message.seconds);
        ImGui::SameLine();
        ImGui::PushTextWrapPos(0);
        if (message.kind == Message::Kind::Note)
            ImGui::TextUnformatted(message.text.c_str());
        else
            ImGui::TextColored(message.kind == Message::Kind::Error ? kError : kWarning, "%s", message.text.c_str());
        ImGui::PopTextWrapPos();
    }
    // The newest message stays in view unless the user has scrolled back.
    if (ImGui::GetScrollY() >= ImGui::GetScrollMaxY()) ImGui::SetScrollHereY(1);
    ImGui::EndChild();
}

}  // namespace touchstone::system
