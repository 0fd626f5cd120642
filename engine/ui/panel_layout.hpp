#pragma once
// Where the panels stand. Their edges can be dragged, and ImGui's ini file remembers them.
#include <imgui.h>

#include <glm/glm.hpp>

namespace touchstone::engine {

/// A rectangle of the window, screen units from its upper-left corner.
struct Area {
    ImVec2 position, size;
};

/// What the user may drag.
struct PanelSizes {
    float left = 20, right = 25, bottom = 8;  ///< in units of the font's size
    float haptics = 0.55f;                    ///< share of the left column
    glm::ivec2 window{0};                     ///< in screen units; 0 x 0 before it is known

    /// Has ImGui's ini file remember these. Before the first frame; they must outlive ImGui's context.
    void remember();
    void keepWindow(glm::ivec2 size);
};

/// The scene's picture gets what the panels leave.
struct Layout {
    Area scene, haptics, plots, log, picture;

    /// `top`: height of the menu bar; `em`: of the font.
    Layout(glm::vec2 window, float top, float em, const PanelSizes& sizes, bool panels);
};

/// Edges between the panels that can be dragged. After the panels.
void drawSplitters(const Layout& layout, float em, PanelSizes& sizes);

}  // namespace touchstone::engine
