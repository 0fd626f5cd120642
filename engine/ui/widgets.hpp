#pragma once
// Helpers for ImGui panels: tooltips, and the rectangles of controls.
#include <glm/glm.hpp>
#include <map>
#include <string>
#include <string_view>

namespace touchstone::engine {

/// Rectangles (x, y, x + width, y + height; screen units) of the controls drawn in a frame, by name. Tests use them to
/// click controls as a user does.
using ItemRects = std::map<std::string, glm::vec4>;

/// Notes the rectangle of ImGui's last item; `rects` may be null.
void noteItem(ItemRects* rects, std::string_view name);

/// Shows a wrapped tooltip while the last item is hovered.
void tooltip(std::string_view text);

}  // namespace touchstone::engine
