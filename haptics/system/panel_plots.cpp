#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "haptics/system/panels.hpp"

namespace touchstone::system {
namespace {

constexpr glm::vec4 kBlue{0.40f, 0.68f, 1.00f, 1}, kOrange{1.00f, 0.62f, 0.25f, 1}, kViolet{0.74f, 0.58f, 1.00f, 1},
    kGreen{0.45f, 0.85f, 0.52f, 1}, kRed{1.00f, 0.42f, 0.36f, 1};

}  // namespace

void drawPlotsPanel(const TickHistory& history, const Settings& settings, PlotsPanelState& state, ItemRects* items) {
    constexpr std::array kWindows{0.25, 1.0, 4.0, 16.0};
    for (const double seconds : kWindows) {
        std::array<char, 16> label{};
        std::snprintf(label.data(), label.size(), "%g s", seconds);
        if (seconds != kWindows.front()) ImGui::SameLine();
        if (ImGui::RadioButton(label.data(), state.seconds == seconds)) state.seconds = seconds;
        noteItem(items, label.data());
    }

    const double wanted = state.seconds * settings.rate;
    const auto window = static_cast<std::size_t>(std::min(wanted, double(TickHistory::kCapacity)));
    constexpr int kPlots = 6;
    // Around the plots stand titles, time axes and lines of values.
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {ImGui::GetStyle().ItemSpacing.x, 2});
    const float line = ImGui::GetTextLineHeightWithSpacing();
    constexpr float kTextLines = 6 + 6 + 11.5f;
    const float height = std::max((ImGui::GetContentRegionAvail().y - kTextLines * line) / kPlots - 4, 2.2f * line);

    const auto plot = [&](const char* title, const char* unit, std::initializer_list<engine::Series> series,
                          bool logarithmic = false, std::optional<float> budget = {}) {
        engine::PlotOptions options;
        options.unit = unit;
        options.logarithmic = logarithmic;
        options.budget = budget;
        options.height = height;
        options.window = window;
        options.samplePeriodMs = static_cast<float>(1000 / settings.rate);
        engine::drawSeries(title, {series.begin(), series.size()}, options);
    };
    const auto of = [&](Channel channel) { return history.view(channel); };
    plot("Time of a tick", "µs",
         {{"total", of(Channel::TotalUs), kBlue},
          {"collision", of(Channel::CollisionUs), kGreen},
          {"solve", of(Channel::SolveUs), kOrange},
          {"shadow", of(Channel::ShadowUs), kViolet}},
         true, static_cast<float>(1e6 / settings.rate));
    plot("Near pairs", "", {{"pairs", of(Channel::Pairs), kBlue}, {"rows", of(Channel::Rows), kOrange}});
    plot("Force", "N", {{"tick", of(Channel::Force), kBlue}, {"out", of(Channel::ForceOut), kOrange}});
    plot("Torque about C", "mN·m", {{"tick", of(Channel::Torque), kBlue}});
    plot("Shadow's force error", "N", {{"error", of(Channel::ShadowForceError), kViolet}});
    plot("Depth", "mm",
         {{"device behind tool", of(Channel::Separation), kBlue},
          {"hover", of(Channel::Hover), kGreen},
          {"penetration", of(Channel::Penetration), kRed}},
         true);
    ImGui::PopStyleVar();
}

}  // namespace touchstone::system
