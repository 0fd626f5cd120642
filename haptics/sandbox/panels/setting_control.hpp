#pragma once
// The control of a setting, made from its row of the setting table.
#include <string>
#include <string_view>

#include "engine/ui/widgets.hpp"
#include "haptics/loop/settings.hpp"

namespace touchstone::sandbox {

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
bool drawSetting(const SettingControl& control, Settings& settings, std::string& refusal, engine::ItemRects* rects);

}  // namespace touchstone::sandbox
