#include "haptics/sandbox/panels/setting_control.hpp"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <vector>

#include "haptics/qp/friction_table.hpp"

namespace touchstone::sandbox {
namespace {

std::string compact(double value, const char* format = "%.6g") {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), format, value);
    return text.data();
}

std::string helpOf(const SettingInfo& info) {
    std::string text(info.help);
    if (info.min != 0 || info.max != 0)
        text += "\n" + compact(info.min) + " to " + compact(info.max) + (info.unit.empty() ? "" : " ") +
                std::string(info.unit) + "; Ctrl+click to type";
    return text + "\n--set " + std::string(info.key);
}

bool drawChoice(const char* id, const std::vector<std::string>& names, std::string& value) {
    bool chosen = false;
    if (ImGui::BeginCombo(id, value.c_str())) {
        for (const std::string& name : names) {
            if (ImGui::Selectable(name.c_str(), name == value) && name != value) {
                value = name;
                chosen = true;
            }
            if (const SolverInfo* solver = findSolver(name)) engine::tooltip(solver->summary);
            if (const FrictionSolverInfo* solver = findFrictionSolver(name)) engine::tooltip(solver->summary);
        }
        ImGui::EndCombo();
    }
    return chosen;
}

/// Whether the setting takes whole numbers only: its default is one, and half more is refused.
bool isCount(std::string_view key) {
    Settings settings;
    const std::string value = getSetting(settings, key);
    return value.find_first_of(".e") == std::string::npos && !setSetting(settings, key, value + ".5").empty();
}

bool drawNumber(const SettingInfo& info, std::string& value, engine::ItemRects* rects) {
    double number = 0;
    std::from_chars(value.data(), value.data() + value.size(), number);
    const bool whole = isCount(info.key);
    const std::string format =
        (whole ? "%.0f" : "%.6g") + (info.unit.empty() ? std::string() : " " + std::string(info.unit));
    const std::string help = helpOf(info);
    double edited = number;
    if (!engine::drawSlider({.label = info.label,
                             .help = help.c_str(),
                             .low = info.low,
                             .high = info.high,
                             .format = format.c_str(),
                             .logarithmic = info.low > 0 && info.high > 20 * info.low},
                            edited, rects, info.key) ||
        edited == number)
        return false;
    // A dragged value is rounded, a typed one is kept exactly.
    const bool dragged = ImGui::IsMouseDown(ImGuiMouseButton_Left);
    value = whole ? compact(std::round(edited), "%.9g") : compact(edited, dragged ? "%.3g" : "%.9g");
    return true;
}

}  // namespace

bool drawSetting(const SettingInfo& info, Settings& settings, std::string& refusal, engine::ItemRects* rects) {
    const std::vector<std::string> names = settingChoices(info.key);
    const std::string before = getSetting(settings, info.key);
    std::string value = before;

    bool changed = false;
    if (names.empty() && before != "on" && before != "off") {
        changed = drawNumber(info, value, rects);
    } else {
        ImGui::PushID(info.label);
        if (names.empty()) {
            bool on = before == "on";
            changed = ImGui::Checkbox(info.label, &on);
            value = on ? "on" : "off";
        } else {
            ImGui::AlignTextToFramePadding();
            ImGui::TextUnformatted(info.label);
            engine::tooltip(helpOf(info));
            ImGui::SameLine(std::max(6 * ImGui::GetFontSize(), ImGui::GetItemRectMax().x - ImGui::GetWindowPos().x +
                                                                   ImGui::GetStyle().ItemSpacing.x));
            ImGui::SetNextItemWidth(-1);
            changed = drawChoice("##value", names, value);
        }
        engine::noteItem(rects, info.key);
        engine::tooltip(helpOf(info));
        ImGui::PopID();
    }
    if (!changed) return false;
    const std::string wrong = setSetting(settings, info.key, value);
    if (!wrong.empty()) refusal = wrong;
    return wrong.empty();
}

}  // namespace touchstone::sandbox
