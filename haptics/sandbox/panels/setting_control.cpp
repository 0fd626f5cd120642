#include "haptics/sandbox/panels/setting_control.hpp"

#include <imgui.h>

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

std::string help(const SettingInfo& info) {
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
            if (const int solver = findSolver(name); solver >= 0) engine::tooltip(solverTable()[solver].summary);
            if (const int solver = findFrictionSolver(name); solver >= 0)
                engine::tooltip(frictionSolverTable()[solver].summary);
        }
        ImGui::EndCombo();
    }
    return chosen;
}

bool drawNumber(const char* id, const SettingInfo& info, std::string& value) {
    double number = 0;
    std::from_chars(value.data(), value.data() + value.size(), number);
    const bool whole = info.unit.empty();  // in the table, a number without a unit is a count
    const std::string format = (whole ? "%.0f" : "%.6g ") + std::string(info.unit);
    const bool wide = info.low > 0 && info.high > 20 * info.low;
    double edited = number;
    if (!ImGui::SliderScalar(id, ImGuiDataType_Double, &edited, &info.low, &info.high, format.c_str(),
                             wide ? ImGuiSliderFlags_Logarithmic : ImGuiSliderFlags_None) ||
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

    ImGui::PushID(info.label);
    bool changed = false;
    if (before == "on" || before == "off") {
        bool on = before == "on";
        changed = ImGui::Checkbox(info.label, &on);
        value = on ? "on" : "off";
    } else {
        ImGui::AlignTextToFramePadding();
        ImGui::TextUnformatted(info.label);
        engine::tooltip(help(info));
        ImGui::SameLine(8.5f * ImGui::GetFontSize());
        ImGui::SetNextItemWidth(-1);
        changed = names.empty() ? drawNumber("##value", info, value) : drawChoice("##value", names, value);
    }
    engine::noteItem(rects, info.key);
    engine::tooltip(help(info));
    ImGui::PopID();
    if (!changed) return false;
    const std::string wrong = setSetting(settings, info.key, value);
    if (!wrong.empty()) refusal = wrong;
    return wrong.empty();
}

}  // namespace touchstone::sandbox
