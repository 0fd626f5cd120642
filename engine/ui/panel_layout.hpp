#pragma once
// Layout of the panels. Their edges can be dragged, and ImGui's ini file stores the sizes.
#include <imgui.h>

#include <glm/glm.hpp>

#include "engine/ui/widgets.hpp"

namespace touchstone::engine {

/// A rectangle of the window, screen units from its upper-left corner.
struct Area {
    ImVec2 position, size;
};

/// Which panels are folded to a narrow strip.
struct Folds {
    bool left = false, right = false, bottom = false;
};

/// Panel sizes that the user can change. By default the 3D view gets more than half of a window of 1280 screen units.
struct PanelSizes {
    float left = 18, right = 21.5f, bottom = 8;  ///< in font sizes
    float haptics = 0.55f;                       ///< share of the height of the left column
    Folds folded;
    glm::ivec2 window{0};  ///< screen units; 0 x 0 while unknown

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

/// Draws the draggable edges between the panels that are not folded. Call after drawing the panels.
void drawSplitters(const Layout& layout, float em, PanelSizes& sizes);

/// A panel that folds: its direction when it does, and the text about it for tooltips.
struct Fold {
    const char* name;
    ImGuiDir outward;
    const char* help;
};
/// Draws the button that folds the panel at the right end of the current window's title, noted as "fold NAME". Returns
/// true when it is pressed.
bool drawFoldButton(const Fold& fold, ItemRects* rects);
/// Draws a folded panel: a strip that is a button, noted as "unfold NAME". Returns true when it is pressed.
bool drawFolded(const Fold& fold, const Area& area, ItemRects* rects);

}  // namespace touchstone::engine
