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

struct Slider {
    const char* label;            ///< not drawn if it begins with ##: what was drawn before in the line is the label
    const char* help;             ///< tooltip
    double low = 0, high = 1;     ///< range of the knob
    const char* format = "%.3g";  ///< of the value with its unit, or the text to show instead
    bool logarithmic = false;
    bool typed = true;  ///< Ctrl+click types a value, which may be out of the range
};

/// Draws a slider of the available width below its label and its value, which the knob cannot cover. Returns true when
/// the user changed `value`. Notes the slider under `name` and the text of the value under "NAME value".
bool drawSlider(const Slider& slider, double& value, ItemRects* rects, std::string_view name);

/// Draws a label with a unit, and below it three numbers to drag or type, marked x, y and z. They are one item of
/// ImGui, noted under `name`. `speed`: per screen unit dragged.
void drawTriple(const char* label, const char* unit, glm::dvec3& values, float speed, const char* help,
                ItemRects* rects, std::string_view name);

/// Closes the list or menu that is open on top of all else, and returns whether one was.
bool closeList();

/// Shows a wrapped tooltip while the last item is hovered.
void tooltip(std::string_view text);

}  // namespace touchstone::engine
