// The fit: whether the tool goes in, and the settings that it needs.
#include <cstdio>

#include "haptics/loop/setting_table.hpp"
#include "haptics/sandbox/panels/panels.hpp"

namespace touchstone::sandbox {

bool drawFit(const Background<FitCheck>& fit, Settings& settings, PanelRequests& requests, engine::ItemRects* items) {
    if (fit.running()) {
        char label[40];
        std::snprintf(label, sizeof label, "Measuring, %.0f %%", 100 * fit.progress());
        ImGui::ProgressBar(static_cast<float>(fit.progress()), {-1, 0}, label);
        engine::noteItem(items, "fit progress");
    }
    if (!fit.refusal().empty()) ImGui::TextWrapped("%s", fit.refusal().c_str());
    const FitCheck* found = fit.result();
    if (!found) return false;
    if (!found->fits()) ImGui::PushStyleColor(ImGuiCol_Text, kAttentionColor);
    ImGui::TextWrapped("The tool %s.", found->verdict.c_str());
    if (!found->fits()) ImGui::PopStyleColor();
    engine::noteItem(items, "fit verdict");
    if (found->thread) ImGui::TextWrapped("Thread: %s.", facetClause(*found->thread).c_str());
    if (found->advice.empty()) return false;
    std::string sets;
    bool taken = true;
    for (const auto& [key, value] : found->advice) {
        sets += (sets.empty() ? "" : ", ") + key + " " + value;
        taken = taken && getSetting(settings, key) == value;
    }
    if (taken) return false;
    const bool take = ImGui::Button(("Set " + sets).c_str(), {-1, 0});
    engine::noteItem(items, "take fit settings");
    if (!take) return false;
    for (const auto& [key, value] : found->advice)
        if (const std::string wrong = setSetting(settings, key, value); !wrong.empty()) requests.refusal = wrong;
    requests.checkFit = true;  // with the new settings
    return true;
}

}  // namespace touchstone::sandbox
