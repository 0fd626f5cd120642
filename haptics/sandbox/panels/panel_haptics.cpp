#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>
#include <vector>

#include "haptics/hands/mouse.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/sandbox/panels/panels.hpp"
#include "haptics/sandbox/panels/setting_control.hpp"
#include "haptics/sandbox/session/presets.hpp"

namespace touchstone::sandbox {
namespace {

void drawHeading(const char* text) {
    ImGui::Spacing();
    ImGui::TextDisabled("%s", text);
}

/// Draws the controls of a group of the setting table.
bool drawGroup(SettingGroup group, Settings& settings, std::string& refusal, engine::ItemRects* items) {
    bool changed = false;
    for (const SettingInfo& info : settingTable())
        if (info.group == group) {
            // Other modes touch spheres, whatever is chosen.
            ImGui::BeginDisabled(info.key == "geometry" && settings.mode != Mode::Default);
            changed |= drawSetting(info, settings, refusal, items);
            ImGui::EndDisabled();
        }
    return changed;
}

constexpr float kBetween = 4;  // screen units between the buttons of a row

/// Width that each button of a row has beside its text, if together they fill the line.
float spareWidth(const std::vector<std::string_view>& texts) {
    float room = ImGui::GetContentRegionAvail().x + kBetween;
    for (const std::string_view text : texts)
        room -= kBetween + ImGui::CalcTextSize(text.data(), text.data() + text.size()).x;
    return std::max(room / static_cast<float>(texts.size()), 0.f);
}

/// Draws a button of a row.
bool drawButton(std::string_view text, float spare) {
    const std::string label(text);
    ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {0, ImGui::GetStyle().FramePadding.y});
    const bool pressed = ImGui::Button(label.c_str(), {ImGui::CalcTextSize(label.c_str()).x + spare, 0});
    ImGui::PopStyleVar();
    return pressed;
}

/// Draws one button per preset, side by side.
bool drawPresets(const Settings& scene, Settings& settings, engine::ItemRects* items) {
    bool changed = false;
    const auto table = presetTable();
    std::vector<std::string_view> names;
    for (const Preset& preset : table) names.push_back(preset.name);
    const float spare = spareWidth(names);
    for (const Preset& preset : table) {
        if (&preset != &table.front()) ImGui::SameLine(0, kBetween);
        Settings chosen = preset.apply(scene);
        chosen.pause = settings.pause;
        const bool isOn = chosen == settings;
        if (isOn) ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_ButtonActive));
        if (drawButton(preset.name, spare) && !isOn) {
            settings = chosen;
            changed = true;
        }
        if (isOn) ImGui::PopStyleColor();
        engine::noteItem(items, "preset " + std::string(preset.name));
        engine::tooltip("Preset: " + std::string(preset.help));
    }
    return changed;
}

void drawStrength(HapticsPanelState& state, engine::ItemRects* items) {
    const double spring = HandParameters{}.times(state.strength).spring;
    std::array<char, 32> shown{};
    std::snprintf(shown.data(), shown.size(), "%.3g N/mm", spring);
    engine::drawSlider(
        {.label = "Mouse stiffness",
         .help = "Stiffness of the virtual hand that pulls the device to the cursor, N/mm. A soft hand lags behind the "
                 "cursor when the tool is blocked; a stiff one presses harder.",
         .low = MouseTarget::kWeakest,
         .high = MouseTarget::kStrongest,
         .format = shown.data(),
         .logarithmic = true,
         .typed = false},
        state.strength, items, "strength");
}

}  // namespace

bool drawHapticsPanel(const Settings& scene, const Background<FitCheck>& fit, Settings& settings,
                      HapticsPanelState& state, PanelRequests& requests, engine::ItemRects* items) {
    const Settings before = settings;
    bool changed = false;

    const char* const pause = settings.pause ? "Resume" : "Pause";
    const float spare = spareWidth({pause, "Reset", "Check fit"});
    if (drawButton(pause, spare)) {
        settings.pause = !settings.pause;
        changed = true;
    }
    engine::noteItem(items, "pause");
    engine::tooltip("Holds the tool in place with zero force.\n--set pause");
    ImGui::SameLine(0, kBetween);
    requests.restart |= drawButton("Reset", spare);
    engine::noteItem(items, "reset");
    engine::tooltip("Returns device and tool to the start of the scene and restarts the demonstration.\nKey R");
    ImGui::SameLine(0, kBetween);
    ImGui::BeginDisabled(fit.running());
    requests.checkFit |= drawButton("Check fit", spare);
    engine::noteItem(items, "check fit");
    engine::tooltip(
        "Measures the clearance between the meshes at the goal and on the way in, and says whether it suffices for "
        "the geometry in use.\ntouchstone fit");
    ImGui::EndDisabled();
    changed |= drawFit(fit, settings, requests, items);

    changed |= drawPresets(scene, settings, items);
    if (drawGroup(SettingGroup::Mode, settings, requests.refusal, items)) {
        settings = withMode(before, settings.mode);
        changed = true;
    }
    drawHeading("Coupling of hand and tool");
    changed |= drawGroup(SettingGroup::Coupling, settings, requests.refusal, items);
    drawStrength(state, items);
    drawHeading("Solvers");
    changed |= drawGroup(SettingGroup::Solvers, settings, requests.refusal, items);
    ImGui::BeginDisabled(settings.shadow == kNoSolver);
    if (ImGui::Button("Swap rendering and shadow solver", {-1, 0})) {
        settings = withSolversSwapped(settings);
        changed = true;
    }
    engine::noteItem(items, "swap");
    engine::tooltip(
        "Exchanges the two roles: the shadow solver renders, and the solver that rendered becomes the shadow.");
    ImGui::EndDisabled();
    changed |= drawGroup(SettingGroup::Approximate, settings, requests.refusal, items);
    drawHeading("Contact");
    changed |= drawGroup(SettingGroup::Contact, settings, requests.refusal, items);
    drawHeading("Friction");
    changed |= drawGroup(SettingGroup::Friction, settings, requests.refusal, items);
    ImGui::Spacing();
    if (ImGui::CollapsingHeader("More settings"))
        changed |= drawGroup(SettingGroup::More, settings, requests.refusal, items);
    engine::noteItem(items, "more");
    requests.copyCommand |= ImGui::Button("Copy as command line", {-1, 0});
    engine::noteItem(items, "copy command");
    engine::tooltip("Copies the command that repeats this run without a window to the clipboard.\nCtrl+Shift+C");

    if (!changed) return false;
    if (settings.margin != before.margin && settings.trust != before.trust) return true;  // a preset sets both
    // The trust radius must stay within the margin, so moving one of them adjusts the other.
    if (settings.margin != before.margin) settings.trust = std::min(settings.trust, settings.margin);
    if (settings.trust != before.trust) settings.margin = std::max(settings.trust, settings.margin);
    if (const std::string wrong = checkSettings(settings); !wrong.empty()) {
        requests.refusal = wrong;
        settings = before;
        return false;
    }
    return true;
}

}  // namespace touchstone::sandbox
