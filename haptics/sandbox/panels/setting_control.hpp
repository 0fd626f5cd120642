#pragma once
// The control of a setting, built from its row of the setting table.
#include <string>
#include <string_view>

#include "engine/ui/widgets.hpp"
#include "haptics/loop/settings.hpp"

namespace touchstone::sandbox {

/// How a setting of settingTable() is shown. Sliders cover [low, high], the usual tuning range; a value typed after
/// Ctrl+click may be anywhere in the table's range.
struct SettingControl {
    std::string_view key;
    const char* label;
    double low = 0, high = 0;  ///< slider range of a number, in the unit of the setting
};

/// Draws the control with its unit; the tooltip shows help and range. Returns true when the user changed the value to
/// one that the table accepts. Otherwise `settings` is unchanged, and `refusal` says why a typed value was rejected.
/// The control is noted in `rects` under the key.
bool drawSetting(const SettingControl& control, Settings& settings, std::string& refusal, engine::ItemRects* rects);

}  // namespace touchstone::sandbox
