#include <imgui.h>

#include <algorithm>

#include "haptics/sandbox/panels/setting_control.hpp"
#include "haptics/sandbox/trials/live_trials.hpp"

namespace touchstone::sandbox {
namespace {

constexpr std::size_t kShown = 3;  // number of coming trials listed

}  // namespace

void LiveTrials::draw(LiveSession& session, const glm::vec4& picture, engine::ItemRects* items) {
    const float em = ImGui::GetFontSize();
    ImGui::SetNextWindowPos({picture.x + 0.5f * em, picture.y + 0.5f * em});
    ImGui::SetNextWindowSize({15 * em, 0});
    ImGui::Begin("Trials", nullptr,
                 ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing);
    if (options_.queue.empty()) {
        ImGui::TextWrapped("All trials are done. Close the window for the summary.");
        engine::noteItem(items, "trials done");
        ImGui::End();
        return;
    }
    const auto nameOf = [&](const Trial& trial) {
        return protocol_.participants[static_cast<std::size_t>(trial.participant)].name + ", " +
               protocol_.conditions[static_cast<std::size_t>(trial.condition)].name;
    };
    const Trial& trial = options_.queue.front();
    ImGui::TextWrapped("Trial %d: %s", trial.number, nameOf(trial).c_str());
    if (running()) {
        const PhaseWatch& phases = measures_->phases();
        ImGui::Text("%s%s, %.1f of %.0f s", name(phases.phase()), phases.jammed() ? " (jammed)" : "",
                    phases.elapsed() / 1000, condition().timeLimit);
        if (ImGui::Button("Abort", {-1, 0})) abort();
        engine::noteItem(items, "trial abort");
    } else {
        const bool failed = !shown(session) && !session.opening();  // opening failed or was canceled
        ImGui::TextWrapped("%s", ready(session) ? "Ready."
                                 : starting_    ? "The tool is held. Press Space to engage."
                                 : failed       ? "The scene is not open."
                                                : "Opening the scene.");
        ImGui::BeginDisabled(!ready(session) && !failed);
        if (ImGui::Button(failed ? "Open scene" : "Start", {-1, 0})) failed ? open(session) : start(session);
        engine::noteItem(items, "trial start");
        ImGui::EndDisabled();
    }
    if (left() > 1) ImGui::TextDisabled("%zu remaining:", left() - 1);
    for (std::size_t i = 1; i < std::min(left(), kShown + 1); ++i)
        ImGui::TextDisabled("  %d: %s", options_.queue[i].number, nameOf(options_.queue[i]).c_str());
    ImGui::End();
}

}  // namespace touchstone::sandbox
