#pragma once
// The panel of plots: the tick over time, what it takes, what it gets, and speed against error.
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "engine/ui/widgets.hpp"
#include "haptics/sandbox/measure/contact_sweep.hpp"
#include "haptics/sandbox/session/tick_history.hpp"

namespace touchstone::sandbox {

enum class PlotsTab { Time, Contact, Trade };

struct PlotsPanelState {
    double seconds = 4;                         ///< across the width
    double behind = 0;                          ///< of the right edge behind the newest tick, s; 0 while ticks come in
    std::shared_ptr<const TickHistory> held;    ///< what is shown in place of the ticks that come in
    std::uint64_t cloudFrom = 0;                ///< of the ticks pushed, the first one of the present solvers
    std::optional<PlotsTab> bring;              ///< a tab to bring to the front in the next frame
    SweepOptions sweep;                         ///< of the next one
    bool readOut = true;                        ///< values under the mouse are told
    std::array<char, 512> exportName{"plots"};  ///< path without extension
    std::optional<float> cursor;                ///< shared by the plots, fraction of the width
    StretchTimes times;                         ///< of the stretch, kept a moment to be readable
    double timesAt = -1;                        ///< ImGui's time when they were taken
    glm::vec4 area{0};                          ///< where tabs and plots were drawn, as ItemRects
    std::array<float, 3> textHeight{};          ///< by tab, the most that stood between its plots
    float width = 0;                            ///< for which that holds
};

struct PlotsView {
    const TickHistory& history;
    const Settings& settings;
    const Sweep* sweep = nullptr;         ///< null: none yet
    std::optional<double> sweepProgress;  ///< of one that runs, 0 to 1
    const std::string& refusal;           ///< why there is none, one sentence
};

/// What the user asked for in a frame.
struct PlotsRequests {
    bool sweep = false, cancelSweep = false;
    std::filesystem::path ticksCsv, sweepCsv, png;  ///< to be written; empty: none
};

/// Draws into the current ImGui window. Wheel over a plot: zoom; drag: hold and look back.
void drawPlotsPanel(const PlotsView& view, PlotsPanelState& state, PlotsRequests& requests, engine::ItemRects* items);

/// The ticks that the panel shows of a history.
engine::Stretch shownStretch(const TickHistory& history, const PlotsPanelState& state, double rate);

}  // namespace touchstone::sandbox
