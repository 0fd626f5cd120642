#pragma once
// Layout of the panels. Their edges can be dragged, and ImGui's ini file stores the sizes.
#include <imgui.h>

#include <glm/glm.hpp>

namespace touchstone::engine {

/// A rectangle of the window, screen units from its upper-left corner.
struct Area {
    ImVec2 position, size;
};

/// Panel sizes that the user can change.
struct PanelSizes {
    float left = 20, right = 25, bottom = 8;  ///< in font sizes
    float haptics = 0.55f;                    ///< share of the height of the left column
    glm::ivec2 window{0};                     ///< screen units; 0 x 0 while unknown

    /// Registers the sizes with ImGui's ini file. Call before the first frame; `this` must outlive ImGui's context.
    void remember();
    /// Notes the current window size and has it stored.
    void keepWindow(glm::ivec2 size);
};

/// Areas of the panels. The 3D view (`picture`) gets the remaining space.
struct Layout {
    Area scene, haptics, plots, log, picture;

    /// `top`: height of the menu bar; `em`: font size; `panels`: panels are shown.
    Layout(glm::vec2 window, float top, float em, const PanelSizes& sizes, bool panels);
};

/// Draws the draggable edges between the panels. Call after drawing the panels.
void drawSplitters(const Layout& layout, float em, PanelSizes& sizes);

}  // namespace touchstone::engine
