#pragma once
// Style of the user interface.

struct ImFontAtlas;

namespace touchstone::engine {

/// Adds a common sans-serif font of the system, or ImGui's built-in font if there is none, of about this pixel height.
void addSansFont(ImFontAtlas& fonts, float pixels);

/// Sets ImGui's dark style, spacing and font for a monitor of the given content scale (1 for 96 dots per
/// inch), with the font of addSansFont(). Call once after ImGui::CreateContext().
void applyStyle(float scale);

}  // namespace touchstone::engine
