#pragma once
// Health of the loop at a glance.
#include <optional>
#include <string>
#include <vector>

#include "engine/ui/widgets.hpp"
#include "haptics/loop/haptic_loop.hpp"
#include "haptics/sandbox/record/recorder.hpp"
#include "haptics/sandbox/scene/gauge.hpp"
#include "haptics/sandbox/session/device_facts.hpp"

namespace touchstone::sandbox {

/// What a frame took of the window's thread.
struct FrameCost {
    double cpuMs = 0;      ///< from the end of its wait for the frame before to the swap
    double drawingMs = 0;  ///< of these in the graphics driver and the code that calls it, the swap included
    int drawCalls = 0;
};

struct HealthView {
    const LoopSnapshot* snapshot = nullptr;  ///< null before the first scene runs
    const RealTimeStatus* realTime = nullptr;
    const std::string& device;
    DeviceFacts facts;
    FrameCost frame = {};                ///< smoothed
    const Recorder* recorder = nullptr;  ///< null while nothing is recorded
    const Gauge* gauge = nullptr;        ///< of the scene, if it has one
};

/// One statement: what, how it stands, and what that means.
struct HealthItem {
    const char* name = "";
    std::string value;
    std::string help;
    bool attention = false;  ///< not as it should be
};

/// Rate, late ticks, dropped records, device, safety, saturation, passivity, the tick's answer, priority and depth;
/// none without a snapshot.
std::vector<HealthItem> healthItems(const HealthView& view);

/// In screen units.
float statusBarHeight();
/// The same in one line of the current ImGui window, each explained on hover. Returns true when the button before them
/// was pressed, which stops or engages.
bool drawStatusBar(const HealthView& view, engine::ItemRects* items);

}  // namespace touchstone::sandbox
