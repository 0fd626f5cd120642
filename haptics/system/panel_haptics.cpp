#include <imgui.h>

#include <algorithm>

#include "haptics/system/panels.hpp"

namespace touchstone::system {
namespace {

constexpr SettingControl kMode{"mode", "Mode"};
constexpr SettingControl kForce[]{
    {"stiffness", "Stiffness", 0.05, 5},
    {"torsion", "Torsion", 50, 5000},
};
constexpr SettingControl kSolvers[]{{"solver", "Solver"}, {"shadow", "Shadow"}};
constexpr SettingControl kApproximate[]{
    {"tolerance", "Tolerance", 1e-6, 1},
    {"iteration_cap", "Iteration cap", 10, 100'000},
    {"screening", "Screening"},
};
constexpr SettingControl kContact[]{
    {"margin", "Margin", 0.02, 2},
    {"trust", "Trust", 0.02, 2},
    {"travel_budget", "Travel budget", 0, 5},
    {"linearisations", "Linearisations", 1, 8},
    {"rate", "Rate", 250, 10'000},
};
constexpr SettingControl kMore[]{
    {"slack", "List slack", 0.02, 4},
    {"adaptive_margin", "Adaptive margin"},
    {"elastic_weight", "Elastic weight", 1, 1e6},
    {"shadow_rows", "Shadow rows", 1, 1000},
    {"shadow_work", "Shadow work", 1e4, 1e8},
    {"solver_work", "Solver work", 1e4, 1e9},
    {"paper_rows", "Paper rows", 1, 4096},
    {"paper_work", "Paper work", 1e5, 1e10},
};

void drawHeading(const char* text) {
    ImGui::Spacing();
    ImGui::TextDisabled("%s", text);
}

template <std::size_t N>
bool drawAll(const SettingControl (&controls)[N], Settings& settings, std::string& refusal, ItemRects* items) {
    bool changed = false;
    for (const SettingControl& control : controls) changed |= drawSetting(control, settings, refusal, items);
    return changed;
}

}  // namespace

bool drawHapticsPanel(Settings& settings, PanelRequests& requests, ItemRects* items) {
    const Settings before = settings;
    bool changed = false;

    const float half = 0.5f * (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x);
    if (ImGui::Button(settings.pause ? "Go on" : "Pause", {half, 0})) {
        settings.pause = !settings.pause;
        changed = true;
    }
    noteItem(items, "pause");
    tooltip("Holds the tool where it is, with zero force.\n--set pause");
    ImGui::SameLine();
    requests.restart |= ImGui::Button("Reset", {half, 0});
    noteItem(items, "reset");
    tooltip("Device and tool back to the start of the scene; the demonstration begins again.\nKey R");

    if (drawSetting(kMode, settings, requests.refusal, items)) {
        settings = withMode(before, settings.mode);
        changed = true;
    }
    drawHeading("Between hand and tool");
    changed |= drawAll(kForce, settings, requests.refusal, items);
    drawHeading("Solvers");
    changed |= drawAll(kSolvers, settings, requests.refusal, items);
    ImGui::BeginDisabled(settings.shadow < 0);
    if (ImGui::Button("Swap rendering and shadow solver", {-1, 0})) {
        settings = withSolversSwapped(settings);
        changed = true;
    }
    noteItem(items, "swap");
    tooltip("The shadow solver renders, and the one that rendered is measured against it.");
    ImGui::EndDisabled();
    changed |= drawAll(kApproximate, settings, requests.refusal, items);
    drawHeading("Contact");
    changed |= drawAll(kContact, settings, requests.refusal, items);
    ImGui::Spacing();
    if (ImGui::CollapsingHeader("More")) changed |= drawAll(kMore, settings, requests.refusal, items);
    noteItem(items, "more");

    if (!changed) return false;
    // Trust stays within the margin: whichever of the two was moved takes the other along.
    if (settings.margin != before.margin) settings.trust = std::min(settings.trust, settings.margin);
    if (settings.trust != before.trust) settings.margin = std::max(settings.trust, settings.margin);
    if (const std::string wrong = checkSettings(settings); !wrong.empty()) {
        requests.refusal = wrong;
        settings = before;
        return false;
    }
    return true;
}

}  // namespace touchstone::system
