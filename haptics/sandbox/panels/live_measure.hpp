#pragma once
// The measuring side of the window: plots, sweeps and exports of a live session.
#include <glm/glm.hpp>

#include "engine/scene/mesh_data.hpp"
#include "haptics/sandbox/panels/panel_plots.hpp"
#include "haptics/sandbox/session/session.hpp"

namespace touchstone::sandbox {

/// Used from the window's thread.
class LiveMeasure {
  public:
    /// Draws the plots into the current ImGui window and does what is asked for there; what fails, and what was
    /// written, is told as a message of the session.
    void draw(LiveSession& session, engine::ItemRects* items);

    /// Sweeps the contact of the newest tick shown, in place of a sweep that runs.
    void sweep(LiveSession& session);
    const SweepRun& sweeps() const { return sweeps_; }

    /// The frame being drawn is wanted as a picture: then take() is to get it, with the window's size in screen units.
    bool wantsPicture() const { return drawing_; }
    void take(const engine::Image& frame, glm::vec2 size, LiveSession& session);

    PlotsPanelState panel;

  private:
    void carryOut(const PlotsRequests& requests, LiveSession& session);

    SweepRun sweeps_;
    std::uint64_t scene_ = 0;
    Settings drawn_;             ///< of the frame before
    std::filesystem::path png_;  ///< to be written of the next frame
    bool drawing_ = false;       ///< ... which is this one
};

}  // namespace touchstone::sandbox
