#pragma once
// Look of the user interface.

struct ImFontAtlas;

namespace touchstone::engine {

/// Adds a common sans-serif font of the system, or ImGui's own where there is none, at about this height in pixels.
void addSansFont(ImFontAtlas& fonts, float pixels);

/// Sets ImGui's dark style, spacing and font for a monitor of the given content scale (1 for 96 dots an inch). Uses a
/// common sans-serif font of the system if there is one, else ImGui's own. Call once after ImGui::CreateContext().
void applyStyle(float scale);

}  // namespace touchstone::engine
