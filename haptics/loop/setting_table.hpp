#pragma once
// The settings by name: the table that the command line, scene files, recordings and panels read.
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "haptics/loop/settings.hpp"
#include "haptics/qp/solver.hpp"

namespace touchstone {

/// The names of the modes on the command line, in the order of the enumeration.
std::span<const std::string_view> modeNames();
/// Likewise.
std::span<const std::string_view> geometryNames();

/// Settings of the solver that moves the tool, in the mode of these settings.
SolverSettings solverSettings(const Settings& settings);

/// Where the haptics panel shows a setting, in the order of the table.
enum class SettingGroup : std::uint8_t { None, Mode, Coupling, Solvers, Approximate, Contact, Friction, More };

/// One setting by name: the table row that the command line, scene files, panels and help read.
struct SettingInfo {
    std::string_view key;   ///< as in --set KEY=VALUE
    std::string_view unit;  ///< "" for counts and names
    std::string_view help;  ///< what it does, and what happens if it is larger or smaller
    double min, max;        ///< accepted range of numbers; both 0 for names and switches
    SettingGroup group = SettingGroup::None;
    const char* label = "";    ///< of its control
    double low = 0, high = 0;  ///< range of its slider: where a number is usually tuned
};

std::span<const SettingInfo> settingTable();

/// A key that files and commands of earlier versions may have, and its key today; empty if the setting is gone.
struct EarlierKey {
    std::string_view earlier, now;
};
std::span<const EarlierKey> earlierSettingKeys();
/// The key of today for one of an earlier version; any other key unchanged.
std::string_view settingKey(std::string_view key);

/// Names that a setting accepts; empty for numbers and switches. Pre: key is in the table. Allocates.
std::vector<std::string> settingChoices(std::string_view key);

/// The value as text that setSetting() reads back to the same bits. Pre: key is in the table.
std::string getSetting(const Settings& settings, std::string_view key);
/// One sentence if a setting asks for friction in a mode that has none; empty otherwise. Only where a user names the
/// setting is that a mistake: a scene's materials have no effect in such a mode.
std::string checkAskedFriction(const Settings& settings, std::string_view key);

}  // namespace touchstone
