#pragma once
// The status bar: health of the loop at a glance.
#include <optional>
#include <string>
#include <vector>

#include "engine/ui/widgets.hpp"
#include "haptics/loop/haptic_loop.hpp"
#include "haptics/sandbox/record/recorder.hpp"
#include "haptics/sandbox/scene/gauge.hpp"
#include "haptics/sandbox/session/device_facts.hpp"

namespace touchstone::sandbox {

/// Cost of a frame on the window's thread.
struct FrameCost {
    double cpuMs = 0;      ///< CPU time from the end of the wait for the previous frame to the buffer swap
    double drawingMs = 0;  ///< part of cpuMs spent in draw calls and the graphics driver, swap included
    int drawCalls = 0;
    double periodMs = 0;    ///< by the clock, from the previous frame to this one
    bool software = false;  ///< the processor draws, not a graphics card
};

struct HealthView {
    const LoopSnapshot* snapshot = nullptr;  ///< null before the first scene runs
    const RealTimeStatus* realTime = nullptr;
    const std::string& device;
    DeviceFacts facts;
    FrameCost frame = {};                ///< smoothed
    const Recorder* recorder = nullptr;  ///< null while nothing is recorded
    const Gauge* gauge = nullptr;        ///< of the scene; null if it has none
};

/// One item of the status bar: name, value, and an explanation.
struct HealthItem {
    const char* name = "";
    std::string value;
    std::string help;
    bool attention = false;  ///< the value is out of the ordinary and is highlighted
    std::string brief = {};  ///< in place of the value where the line has no room for it; empty: none
};

/// Rate, late ticks, dropped records, device, safety, load, passivity, status of the tick, priority, frame time,
/// recording and depth. Empty without a snapshot.
std::vector<HealthItem> healthItems(const HealthView& view);

/// Height of the status bar, screen units.
float statusBarHeight();
/// Draws healthItems() in one line of the current ImGui window, each with a tooltip, after the Stop/Engage button.
/// Returns true when that button was pressed.
bool drawStatusBar(const HealthView& view, engine::ItemRects* items);

}  // namespace touchstone::sandbox
