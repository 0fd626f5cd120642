#pragma once
// Building blocks of the panels: a control for each setting, made from the setting table.
#include <glm/glm.hpp>
#include <map>
#include <string>
#include <string_view>

#include "haptics/loop/settings.hpp"

namespace touchstone::system {

/// Rectangles (x, y, x + width, y + height; screen units) of the controls drawn in a frame, by name: what lets a test
/// act as a user does.
using ItemRects = std::map<std::string, glm::vec4>;

/// Notes the rectangle of ImGui's last item; `rects` may be null.
void noteItem(ItemRects* rects, std::string_view name);

/// Shows a wrapped tooltip while the last item is hovered.
void tooltip(std::string_view text);

/// How a setting of settingTable() is shown. Sliders cover [low, high], where it is usually tuned; a value typed after
/// Ctrl and click may lie anywhere in the table's range.
struct SettingControl {
    std::string_view key;
    const char* label;
    double low = 0, high = 0;  ///< of numbers
};

/// Draws the control with its unit, and its help and range as tooltip. Returns true when the user changed the value,
/// which is then one that the table accepts; a typed one that it does not accept leaves `settings` and goes to
/// `refusal`. Noted in `rects` under the key.
bool drawSetting(const SettingControl& control, Settings& settings, std::string& refusal, ItemRects* rects);

}  // namespace touchstone::system
