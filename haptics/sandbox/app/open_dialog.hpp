#pragma once
// The dialog that opens a scene.
#include "haptics/sandbox/panels/panels.hpp"

namespace touchstone::sandbox {

/// Draws the dialog requested in `state`. Call it where drawDialogs() is called.
void drawOpenDialog(const MenuView& view, MenuState& state, PanelRequests& requests, engine::ItemRects* items);

}  // namespace touchstone::sandbox
