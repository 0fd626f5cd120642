#pragma once
// The measuring side of the window: plots, sweeps and exports of a live session.
#include <glm/glm.hpp>

#include "engine/scene/mesh_data.hpp"
#include "haptics/sandbox/measure/fit_check.hpp"
#include "haptics/sandbox/panels/panel_plots.hpp"
#include "haptics/sandbox/session/session.hpp"

namespace touchstone::sandbox {

/// Used from the window's thread.
class LiveMeasure {
  public:
    /// Draws the plots into the current ImGui window and carries out the user's requests there. Failures and written
    /// files are reported as messages of the session.
    void draw(LiveSession& session, engine::ItemRects* items);

    /// Sweeps the contact of the newest tick shown. Replaces a running sweep.
    void sweep(LiveSession& session);
    const SweepRun& sweeps() const { return sweeps_; }

    /// Checks whether the tool fits, with the settings of the session. Replaces a running check.
    void checkFit(LiveSession& session);
    /// The newest check of the scene shown. Call once a frame.
    const Background<FitCheck>& fit(const LiveSession& session);

    /// Whether the frame being drawn must be captured; if so, pass it to savePicture() with the window's size in screen
    /// units.
    bool wantsPicture() const { return drawing_; }
    void savePicture(const engine::Image& frame, glm::vec2 size, LiveSession& session);

    PlotsPanelState panel;

  private:
    void carryOut(const PlotsRequests& requests, LiveSession& session);

    SweepRun sweeps_;
    Background<FitCheck> fit_;
    std::uint64_t scene_ = 0, fitScene_ = 0;
    Settings drawn_;             ///< settings of the previous frame
    std::filesystem::path png_;  ///< picture to write from the next frame; empty: none
    bool drawing_ = false;       ///< whether that frame is the current one
};

}  // namespace touchstone::sandbox
