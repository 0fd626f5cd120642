#pragma once
// The control of a setting, built from its row of the setting table.
#include <string>

#include "engine/ui/widgets.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/loop/settings.hpp"

namespace touchstone::sandbox {

/// Draws the control of a row of settingTable() with its unit; the tooltip shows help and range. A slider covers the
/// usual tuning range; a value typed after Ctrl+click may be anywhere in the table's range. Returns true when the user
/// changed the value to one that the table accepts. Otherwise `settings` is unchanged, and `refusal` says why a typed
/// value was rejected. The control is noted in `rects` under the key.
bool drawSetting(const SettingInfo& info, Settings& settings, std::string& refusal, engine::ItemRects* rects);

}  // namespace touchstone::sandbox
