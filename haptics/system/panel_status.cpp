#include <imgui.h>

#include <array>
#include <cstdio>

#include "haptics/system/panels.hpp"

namespace touchstone::system {
namespace {

const ImVec4 kWarning{1.00f, 0.78f, 0.35f, 1};

/// "name value" with the value in a colour of its own where it asks for attention.
void drawValue(const char* name, const std::string& value, bool attention, const char* help) {
    ImGui::BeginGroup();
    ImGui::TextDisabled("%s", name);
    ImGui::SameLine(0, 0.35f * ImGui::GetFontSize());
    if (attention)
        ImGui::TextColored(kWarning, "%s", value.c_str());
    else
        ImGui::TextUnformatted(value.c_str());
    ImGui::EndGroup();
    tooltip(help);
}

void nextValue(const char* name, const std::string& value) {
    // Breaks the line where the next value would not fit.
    const float width = ImGui::CalcTextSize((std::string(name) + value).c_str()).x + 2.5f * ImGui::GetFontSize();
    ImGui::SameLine(0, 1.2f * ImGui::GetFontSize());
    if (ImGui::GetContentRegionAvail().x < width) ImGui::NewLine();
}

std::string tripsText(const LoopSnapshot& snapshot) {
    std::string text;
    for (std::size_t i = 0; i < snapshot.trips.size(); ++i)
        if (const TripCount& trip = snapshot.trips[i]; trip.events > 0)
            text += (text.empty() ? "" : ", ") + std::string(name(static_cast<Trip>(i))) + " " +
                    std::to_string(trip.events) + " times, " + std::to_string(trip.ticks) + " ticks";
    return text;
}

void drawHealth(const StatusView& view) {
    const LoopSnapshot& s = *view.snapshot;
    bool first = true;
    const auto value = [&](const char* title, const std::string& text, bool attention, const char* help) {
        if (!first) nextValue(title, text);
        first = false;
        drawValue(title, text, attention, help);
    };
    const auto number = [](const char* format, double v) {
        std::array<char, 48> text{};
        std::snprintf(text.data(), text.size(), format, v);
        return std::string(text.data());
    };
    value("Device", view.device + (s.finished ? " (ended)" : ""), false,
          "What holds the tool. Menu Device chooses another.");
    value("Rate", number("%.0f Hz", s.rate), s.rate > 0 && s.rate < 0.98 * s.settings.rate,
          "Ticks per second over the last quarter of a second.");
    value("Overruns", std::to_string(s.overruns), s.ticks > 0 && double(s.overruns) > 0.01 * double(s.ticks),
          "Ticks that ended after their deadline.");
    value("List helper", number("%.0f µs", s.record.helperUs), false,
          "Processor time that the thread beside the loop took in the last tick to find pair lists ahead.");
    value("Dropped", std::to_string(s.dropped), s.dropped > 0,
          "Ticks lost to the plots because the window was too slow.");
    std::uint64_t trips = 0;
    for (const TripCount& trip : s.trips) trips += trip.events;
    const std::string which = tripsText(s);
    value("Safety trips", std::to_string(trips), trips > 0,
          which.empty() ? "How often the safety stage stepped in." : which.c_str());
    const bool realTime = view.realTime && view.realTime->scheduled;
    value("Priority", realTime ? "real time" : "normal", !realTime,
          realTime        ? "The haptic thread runs under SCHED_FIFO."
          : view.realTime ? view.realTime->message.c_str()
                          : "");

    const TickRecord& r = s.record;
    const bool clamped = s.fade >= 1 && r.wrench_out.force.norm() < 0.999 * r.wrench_o.force.norm();
    value("Force", number("%.2f N", r.wrench_C.force.norm()) + (clamped ? " (saturated)" : ""), clamped,
          "On the hand; saturated where it is more than the device can give.");
    value("Torque", number("%.0f mN·m", r.wrench_C.torque.norm()), false, "On the hand, about C.");
    std::string state = s.settings.pause ? "paused" : s.fade < 1 ? "fading" : name(r.status);
    const bool odd = (r.flags & (kInfeasible | kNonFinite | kRowsTruncated | kListOverflow | kBadInput)) != 0;
    if (r.flags & kNonFinite) state += ", not finite";
    if (r.flags & kRowsTruncated) state += ", rows truncated";
    if (r.flags & kListOverflow) state += ", list overflow";
    if (r.flags & kBadInput) state += ", bad input";
    value("Tick", state, odd, "What the last tick's solver says, and what was out of the ordinary.");
}

}  // namespace

void drawStatusPanel(const StatusView& view) {
    if (view.snapshot)
        drawHealth(view);
    else
        ImGui::TextDisabled("No scene runs.");
}

}  // namespace touchstone::system
