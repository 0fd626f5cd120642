#include "haptics/sandbox/app/panel_demonstration.hpp"

#include <imgui.h>

#include <array>
#include <cstdio>

namespace touchstone::sandbox {

void drawDemonstration(const DemonstrationView& view, PanelRequests& requests, engine::ItemRects* items) {
    std::array<char, 64> text{};
    if (view.recordedMs)
        std::snprintf(text.data(), text.size(), "Finish demonstration: %.1f s###record demonstration",
                      *view.recordedMs / 1000);
    else
        std::snprintf(text.data(), text.size(), "Record demonstration###record demonstration");
    ImGui::BeginDisabled(!view.running && !view.recordedMs);
    if (view.recordedMs) ImGui::PushStyleColor(ImGuiCol_Button, {0.55f, 0.16f, 0.14f, 1});
    if (ImGui::Button(text.data(), {-1, 0})) requests.recordDemonstration = true;
    if (view.recordedMs) ImGui::PopStyleColor();
    ImGui::EndDisabled();
    engine::noteItem(items, "record demonstration");
    engine::tooltip(
        "Records how you move the tool, with any device. When you finish, it is the demonstration of the scene: Replay "
        "runs it, Ctrl+S saves it, Ctrl+Z brings back the one before. A pause takes no time; Reset begins again.");
    const float half = 0.5f * (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x);
    ImGui::BeginDisabled(!view.running || !view.hasDemonstration || view.recordedMs);
    if (ImGui::Button("Replay", {half, 0})) requests.replayDemonstration = true;
    ImGui::EndDisabled();
    engine::noteItem(items, "replay demonstration");
    engine::tooltip("Runs the demonstration of the scene from its start.");
    ImGui::SameLine();
    ImGui::BeginDisabled(!view.running);
    if (ImGui::Button("Set goal here", {half, 0})) requests.setGoal = true;
    ImGui::EndDisabled();
    engine::noteItem(items, "set goal");
    engine::tooltip(
        view.hasGoal
            ? "Moves the goal of the scene to the tool. The page Selected has its tolerances."
            : "Makes the present pose of the tool the goal of the scene, which moves with the nearest obstacle. "
              "The page Selected has its tolerances.");
}

}  // namespace touchstone::sandbox
