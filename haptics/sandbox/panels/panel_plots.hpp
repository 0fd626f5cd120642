#pragma once
// The plots panel: times of the tick, contact quantities, and solver speed vs. error.
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "engine/ui/widgets.hpp"
#include "haptics/sandbox/measure/contact_sweep.hpp"
#include "haptics/sandbox/session/tick_history.hpp"

namespace touchstone::sandbox {

enum class PlotsTab { Time, Contact, Friction, Trade };

struct PlotsPanelState {
    double seconds = 4;                         ///< time span across the width, s
    double behind = 0;                          ///< lag of the right edge behind the newest tick, s; 0 while live
    std::shared_ptr<const TickHistory> held;    ///< history shown while the plots are held; null: live
    std::uint64_t firstCloudTick = 0;           ///< number of the first tick pushed with the current solvers
    std::optional<PlotsTab> bring;              ///< a tab to bring to the front in the next frame
    SweepOptions sweep;                         ///< options of the next sweep
    bool showValues = true;                     ///< show the values under the mouse
    std::array<char, 512> exportName{"plots"};  ///< path without extension
    std::optional<float> cursor;                ///< shared by the plots, fraction of the width
    StretchTimes times;                         ///< of the stretch, held briefly to stay readable
    double timesAt = -1;                        ///< ImGui time when `times` was taken
    glm::vec4 area{0};                          ///< rectangle of tabs and plots, as in ItemRects
    std::array<float, 4> textHeight{};          ///< per tab, the largest height of the text between its plots
    float width = 0;                            ///< window width for which `textHeight` is valid
};

struct PlotsView {
    const TickHistory& history;
    const Settings& settings;
    const Sweep* sweep = nullptr;         ///< null: none yet
    std::optional<double> sweepProgress;  ///< of a running sweep, 0 to 1
    const std::string& refusal;           ///< why there is no sweep, one sentence; empty: no failure
    bool friction = false;                ///< hasFriction(): the friction solver and its shadow are in use
};

/// What the user requested in a frame.
struct PlotsRequests {
    bool sweep = false, cancelSweep = false;
    std::filesystem::path ticksCsv, sweepCsv, png;  ///< files to write; empty: none
};

/// Draws into the current ImGui window. The wheel over a plot zooms; a drag holds the plots and scrolls back in time.
void drawPlotsPanel(const PlotsView& view, PlotsPanelState& state, PlotsRequests& requests, engine::ItemRects* items);

/// The stretch of a history that the panel shows. `rate`: Hz.
engine::Stretch shownStretch(const TickHistory& history, const PlotsPanelState& state, double rate);

}  // namespace touchstone::sandbox
