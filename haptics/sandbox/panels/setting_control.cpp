#include "haptics/sandbox/panels/setting_control.hpp"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <vector>

namespace touchstone::sandbox {
namespace {

const SettingInfo& infoOf(std::string_view key) {
    const auto table = settingTable();
    const auto found =
        std::find_if(table.begin(), table.end(), [&](const SettingInfo& info) { return info.key == key; });
    assert(found != table.end());
    return *found;
}

std::string compact(double value, const char* format = "%.6g") {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), format, value);
    return text.data();
}

std::string help(const SettingInfo& info) {
    std::string text(info.help);
    if (info.min != 0 || info.max != 0)
        text += "\n" + compact(info.min) + " to " + compact(info.max) + (info.unit.empty() ? "" : " ") +
                std::string(info.unit) + "; Ctrl+click to type";
    return text + "\n--set " + std::string(info.key);
}

/// The values of a setting that is chosen from a list; empty for numbers and switches.
std::vector<std::string> choices(std::string_view key) {
    if (key == "mode") return {modeNames().begin(), modeNames().end()};
    if (key == "screening") return {"none", "screen", "cluster"};
    if (key != "solver" && key != "shadow") return {};
    std::vector<std::string> names;
    for (const SolverInfo& solver : solverTable()) names.emplace_back(solver.name);
    if (key == "shadow") names.emplace_back("none");
    return names;
}

bool drawChoice(const char* id, const std::vector<std::string>& names, std::string& value) {
    bool chosen = false;
    if (ImGui::BeginCombo(id, value.c_str())) {
        for (const std::string& name : names) {
            if (ImGui::Selectable(name.c_str(), name == value) && name != value) {
                value = name;
                chosen = true;
            }
            if (const int solver = findSolver(name); solver >= 0) engine::tooltip(solverTable()[solver].summary);
        }
        ImGui::EndCombo();
    }
    return chosen;
}

bool drawNumber(const char* id, const SettingControl& control, const SettingInfo& info, std::string& value) {
    double number = 0;
    std::from_chars(value.data(), value.data() + value.size(), number);
    const bool whole = info.unit.empty();  // in the table, a number without a unit is a count
    const std::string format = (whole ? "%.0f" : "%.6g ") + std::string(info.unit);
    const bool wide = control.low > 0 && control.high > 20 * control.low;
    double edited = number;
    if (!ImGui::SliderScalar(id, ImGuiDataType_Double, &edited, &control.low, &control.high, format.c_str(),
                             wide ? ImGuiSliderFlags_Logarithmic : ImGuiSliderFlags_None) ||
        edited == number)
        return false;
    // A dragged value is rounded, a typed one is kept exactly.
    const bool dragged = ImGui::IsMouseDown(ImGuiMouseButton_Left);
    value = whole ? compact(std::round(edited), "%.9g") : compact(edited, dragged ? "%.3g" : "%.9g");
    return true;
}

}  // namespace

bool drawSetting(const SettingControl& control, Settings& settings, std::string& refusal, engine::ItemRects* rects) {
    const SettingInfo& info = infoOf(control.key);
    const std::vector<std::string> names = choices(control.key);
    const std::string before = getSetting(settings, control.key);
    std::string value = before;

    ImGui::PushID(control.label);
    bool changed = false;
    if (before == "on" || before == "off") {
        bool on = before == "on";
        changed = ImGui::Checkbox(control.label, &on);
        value = on ? "on" : "off";
    } else {
        ImGui::AlignTextToFramePadding();
        ImGui::TextUnformatted(control.label);
        engine::tooltip(help(info));
        ImGui::SameLine(8.5f * ImGui::GetFontSize());
        ImGui::SetNextItemWidth(-1);
        changed = names.empty() ? drawNumber("##value", control, info, value) : drawChoice("##value", names, value);
    }
    engine::noteItem(rects, control.key);
    engine::tooltip(help(info));
    ImGui::PopID();
    if (!changed) return false;
    const std::string wrong = setSetting(settings, control.key, value);
    if (!wrong.empty()) refusal = wrong;
    return wrong.empty();
}

}  // namespace touchstone::sandbox
