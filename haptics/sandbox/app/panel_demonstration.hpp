#pragma once
// The buttons of the demonstration and of the goal.
#include "haptics/sandbox/panels/panels.hpp"

namespace touchstone::sandbox {

struct DemonstrationView {
    bool running = false, hasDemonstration = false, hasGoal = false;
    std::optional<double> recordedMs = {};  ///< duration of the demonstration that is being recorded
};
/// Draws the buttons that record a demonstration, replay it, and set the goal.
void drawDemonstration(const DemonstrationView& view, PanelRequests& requests, engine::ItemRects* items);

}  // namespace touchstone::sandbox
