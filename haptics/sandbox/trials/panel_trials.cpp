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
    if (!options_.queue.empty()) {
        const Trial& trial = options_.queue.front();
        ImGui::TextWrapped("Trial %d of %zu: %s", trial.number, protocol_.trials().size(), nameOf(trial).c_str());
    }
    ImGui::PushStyleColor(ImGuiCol_Text, {0.55f, 0.80f, 1.00f, 1});
    ImGui::TextWrapped("%s", nextStep(session).c_str());
    ImGui::PopStyleColor();
    engine::noteItem(items, options_.queue.empty() ? "trials done" : "trial next");
    if (running()) {
        const PhaseWatch& phases = measures_->phases();
        ImGui::Text("%s%s, %.1f of %.0f s", name(phases.phase()), phases.jammed() ? " (jammed)" : "",
                    phases.elapsed() / 1000, condition().timeLimit);
        if (ImGui::Button("Abort", {-1, 0})) abort();
        engine::noteItem(items, "trial abort");
    } else if (!options_.queue.empty()) {
        ImGui::BeginDisabled(!ready(session) && !failed(session));
        if (ImGui::Button(failed(session) ? "Open scene" : "Start", {-1, 0}))
            failed(session) ? open(session) : start(session);
        engine::noteItem(items, "trial start");
        ImGui::EndDisabled();
    }
    if (!lastOutcome_.empty()) {
        ImGui::Separator();
        ImGui::TextWrapped("Last: %s", lastOutcome_.c_str());
        engine::noteItem(items, "trial last");
    }
    if (left() > 1) {
        ImGui::Separator();
        ImGui::TextDisabled("Then:");
    }
    for (std::size_t i = 1; i < std::min(left(), kShown + 1); ++i) {
        ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
        ImGui::TextWrapped("%d: %s", options_.queue[i].number, nameOf(options_.queue[i]).c_str());
        ImGui::PopStyleColor();
    }
    if (left() > kShown + 1) ImGui::TextDisabled("and %zu more", left() - kShown - 1);
    ImGui::End();
}

}  // namespace touchstone::sandbox
