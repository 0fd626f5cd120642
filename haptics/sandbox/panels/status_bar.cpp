#include "haptics/sandbox/panels/status_bar.hpp"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include "engine/scene/text.hpp"

namespace touchstone::sandbox {
namespace {

HealthItem safetyItem(const LoopSnapshot& s) {
    HealthItem item{.name = "Safety", .value = "ok", .help = "The safety stage passes the tick's wrench unchanged."};
    std::uint64_t events = 0;
    std::string past;
    for (std::size_t i = 0; i < s.trips.size(); ++i) {
        const Trip trip = static_cast<Trip>(i);
        if (s.trips[i].events > 0)
            past += engine::formatted("\n%s: %llu times, %llu ticks", name(trip),
                                      static_cast<unsigned long long>(s.trips[i].events),
                                      static_cast<unsigned long long>(s.trips[i].ticks));
        events += s.trips[i].events;
        if (s.record.trips & bit(trip)) {
            item.value = name(trip);
            item.help = info(trip).why;
            item.attention = true;
        }
    }
    if (s.engagement == Engagement::Stopped) {
        item = {"Safety", "stopped", "Zero force, and the tool is held. Press Engage to continue from here.", true};
    } else if (s.engagement == Engagement::Faulted) {
        item = {"Safety", std::string("fault: ") + name(s.cause),
                std::string(info(s.cause).why) + " Zero force until you press Engage.", true};
    } else if (s.engagement == Engagement::Engaging && !item.attention) {
        item = {"Safety", "engaging", "The force fades in once the requested force is small: move out of contact.",
                false};
    }
    if (!item.attention && events > 0)
        item.value += engine::formatted(", %llu trips", static_cast<unsigned long long>(events));
    item.help += past.empty() ? "" : "\nSince the scene started:" + past;
    return item;
}

/// Forces and torques are those at the hand: the workspace scale is divided out.
HealthItem saturationItem(const LoopSnapshot& s, const DeviceFacts& facts) {
    const Wrench& wanted = s.record.wrench_o;
    const double force = wanted.force.norm() / facts.scale,
                 torque = wanted.torque.cwiseAbs().maxCoeff() / (facts.scale * facts.scale);
    const DeviceLimits& limits = facts.limits;
    const double share = std::max(force / limits.peakForce, torque / limits.peakTorque);
    const bool saturated = s.record.trips & (bit(Trip::ForceClamped) | bit(Trip::TorqueClamped));
    return {.name = "Load",
            .value = saturated ? engine::formatted("saturated") : engine::formatted("%.0f %%", 100 * share),
            .help = engine::formatted(
                "Requested share of the device's peak: %.2f of %g N, %.0f of %g mN·m per axis. Above 100 %% the "
                "contact feels softer than it is.",
                force, limits.peakForce, torque, limits.peakTorque),
            .attention = saturated};
}

HealthItem passivityItem(const Settings& settings, const DeviceFacts& facts) {
    const std::optional<DeviceDynamics>& dynamics = facts.dynamics;
    constexpr double kUsualDelay = 1;  // ticks: delay added by a device's own driver
    const double delay = dynamics ? dynamics->delay : kUsualDelay;
    const double least = leastDamping(settings.stiffness, settings.rate, delay);
    std::string law = engine::formatted(
        "Whether the contact can buzz: it may if it gives the hand more energy than hand and device dissipate. A "
        "contact of stiffness k with sample time T and a delay of d ticks is passive if the damping of device and hand "
        "is at least k T (0.5 + d) = %g N/mm x %g ms x (0.5 + %g) = %.3g N·s/m. ",
        settings.stiffness, 1000 / settings.rate, delay, least);
    if (facts.scale != 1)
        law +=
            engine::formatted("The tool moves %g mm per mm of the hand; k is the stiffness at the hand. ", facts.scale);
    if (!dynamics)
        return {
            .name = "Passivity",
            .value = engine::formatted("min %.2g N·s/m", least),
            .help =
                law +
                "The damping of this device is unknown, or the device does not move; a delay of one tick is assumed."};
    const double margin = dynamics->damping - least;
    return {.name = "Passivity",
            .value = engine::formatted("%+.2g N·s/m", margin),
            .help = law + engine::formatted("This device has %.3g N·s/m, so the margin is %+.3g N·s/m. A negative "
                                            "margin may cause buzzing: lower the "
                                            "stiffness or raise the tick rate.",
                                            dynamics->damping, margin),
            .attention = margin < 0};
}

HealthItem tickItem(const LoopSnapshot& s) {
    const TickRecord& r = s.record;
    std::string value = s.settings.pause            ? "paused"
                        : !isEngaged(s.engagement)  ? name(s.engagement)
                        : s.fade < 1                ? "fading"
                        : (r.flags & kObstacleHeld) ? "obstacle held"
                                                    : name(r.status);
    if (r.flags & kNonFinite) value += ", non-finite";
    if (r.flags & kRowsTruncated) value += ", rows truncated";
    if (r.flags & kListOverflow) value += ", list overflow";
    if (r.flags & kBadInput) value += ", bad input";
    if (r.flags & kOverlapping) value += ", parts overlap";
    if (r.flags & kByProcessor) value += ", solved by the processor";
    if (r.sticking + r.sliding > 0) value += engine::formatted(", %d stick, %d slide", r.sticking, r.sliding);
    return {.name = "Tick",
            .value = value,
            .help = engine::formatted(
                        "Solver status and warnings of the newest tick. Force %.2f N, torque %.0f mN·m about C.",
                        r.wrench_C.force.norm(), r.wrench_C.torque.norm()) +
                    (r.flags & kOverlapping
                         ? " The tool began inside an obstacle: it passes through the faces that it is behind "
                           "until it is out, and feels all others."
                         : ""),
            .attention = (r.flags & (kInfeasible | kNonFinite | kRowsTruncated | kListOverflow | kBadInput |
                                     kObstacleHeld | kOverlapping | kByProcessor)) != 0};
}

}  // namespace

std::vector<HealthItem> healthItems(const HealthView& view) {
    if (!view.snapshot) return {};
    const LoopSnapshot& s = *view.snapshot;
    const bool troubled = view.facts.status && view.facts.status->state != DeviceStatus::State::Running;
    const bool realTime = view.realTime && view.realTime->scheduled;
    const auto count = [](std::uint64_t n) { return std::to_string(n); };
    std::vector<HealthItem> items{
        {.name = "Rate",
         .value = engine::formatted("%.0f Hz", s.rate),
         .help = engine::formatted(
             "Ticks per second, averaged over the last quarter of a second. The set rate is %g Hz.", s.settings.rate),
         .attention = s.rate > 0 && s.rate < 0.98 * s.settings.rate},
        {.name = "Late",
         .value = count(s.overruns),
         .help = engine::formatted(
             "Late ticks, which ended after their deadline, of %llu since the loop started. The next tick then starts "
             "at once. More than one in a hundred is highlighted.",
             static_cast<unsigned long long>(s.ticks)),
         .attention = s.ticks > 0 && double(s.overruns) > 0.01 * double(s.ticks)},
        {.name = "Dropped",
         .value = count(s.dropped),
         .help = "Ticks missing from the plots because the window was too slow. The loop itself never waits for the "
                 "window.",
         .attention = s.dropped > 0},
        {.name = "Device",
         // The options of hardware are long, and in the tooltip.
         .value = (view.facts.status ? view.device.substr(0, view.device.find(':')) : view.device) +
                  (s.finished ? " (ended)"
                   : troubled ? " (" + std::string(name(view.facts.status->state)) + ")"
                              : ""),
         .help = "The device that moves the tool, " + view.device + ". Choose another one in the Device menu." +
                 (troubled ? "\n" + view.facts.status->text : ""),
         .attention = troubled},
        safetyItem(s),
        saturationItem(s, view.facts),
        passivityItem(s.settings, view.facts),
        tickItem(s),
        {.name = "Priority",
         .value = realTime ? "real time" : "normal",
         .help = realTime        ? "The haptic thread runs under SCHED_FIFO. " + throttlingWords(*view.realTime)
                 : view.realTime ? view.realTime->message
                                 : "",
         .attention = !realTime},
        {.name = "Frame",
         .value =
             engine::formatted("%.0f ms", view.frame.periodMs) + (view.frame.software ? ", drawn by software" : ""),
         .help = engine::formatted(
                     "Time from one picture of the window to the next. Its thread takes %.1f ms of that "
                     "for drawing, in %d draw calls, and %.1f ms for everything else. The loop has its own "
                     "thread, and so has the list worker, which finds near pairs ahead: it took %.0f µs in the "
                     "last tick.",
                     view.frame.drawingMs, view.frame.drawCalls, view.frame.cpuMs - view.frame.drawingMs,
                     s.record.listWorkerUs) +
                 (view.frame.software ? " No graphics card draws here, so the scene is drawn coarsely while it moves."
                                      : ""),
         .brief = engine::formatted("%.0f ms", view.frame.periodMs)},
    };
    if (view.recorder)
        items.push_back({.name = "Recording",
                         .value = count(view.recorder->rows()),
                         .help = "Ticks recorded so far to " + view.recorder->folder().string(),
                         .attention = true});
    if (view.gauge)
        items.push_back(
            {.name = "Depth",
             .value = engine::formatted("%.2f mm", view.gauge->depth(s.record.X_WT)),
             .help = view.gauge->name + ": depth of the tool's tip below the plane of the gauge; negative above it."});
    return items;
}

float statusBarHeight() { return 1.5f * ImGui::GetFontSize(); }

bool drawStatusBar(const HealthView& view, engine::ItemRects* items) {
    bool pressed = false;
    if (view.snapshot) {
        const bool engaged = isEngaged(view.snapshot->engagement);
        pressed = ImGui::SmallButton(engaged ? "Stop" : "Engage");
        engine::noteItem(items, "engage");
        engine::tooltip(engaged ? "Sets the force to zero at once and holds the tool.\nKey Space"
                                : "Continues from the tool's pose, and the force fades in.\nKey Space");
        ImGui::SameLine(0, 0.6f * ImGui::GetFontSize());
    }
    std::vector<HealthItem> all = healthItems(view);
    if (all.empty()) ImGui::TextDisabled("No scene is running.");
    // Move the items closer together if they would not fit otherwise.
    const float em = ImGui::GetFontSize(), inside = 0.35f * em;
    const float count = static_cast<float>(all.size());
    const auto roomLeft = [&] {
        float room = ImGui::GetContentRegionAvail().x;
        for (const HealthItem& item : all)
            room -= ImGui::CalcTextSize(item.name).x + inside + ImGui::CalcTextSize(item.value.c_str()).x;
        return room;
    };
    if (roomLeft() < 0.5f * em * count)
        for (HealthItem& item : all)
            if (!item.brief.empty()) item.value = item.brief;
    const float between = std::clamp(roomLeft() / std::max(count, 1.f), 0.5f * em, 1.2f * em);
    for (const HealthItem& item : all) {
        if (&item != &all.front()) ImGui::SameLine(0, between);
        ImGui::BeginGroup();
        ImGui::TextDisabled("%s", item.name);
        ImGui::SameLine(0, inside);
        if (item.attention)
            ImGui::TextColored({1.00f, 0.78f, 0.35f, 1}, "%s", item.value.c_str());
        else
            ImGui::TextUnformatted(item.value.c_str());
        ImGui::EndGroup();
        engine::noteItem(items, std::string("health ") + item.name);
        engine::tooltip(item.help);
    }
    return pressed;
}

}  // namespace touchstone::sandbox
