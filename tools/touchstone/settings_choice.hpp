#pragma once
// The settings of a run: defaults, then the scene's, then the command line's.
#include <optional>
#include <string>
#include <vector>

#include "haptics/loop/settings.hpp"
#include "tools/touchstone/commands.hpp"

namespace touchstone::app {

/// Settings on the command line, as text, checked as those of a scene are.
struct SettingsChoice {
    std::optional<std::string> mode, geometry, solver, shadow, tolerance, rate;
    std::vector<std::string> set;  ///< KEY=VALUE
};

/// Changes the settings of a scene by --mode, --geometry, --solver, --shadow, --tolerance and --rate, then by --set in
/// its order. Throws UsageError with one sentence for a key or value that does not exist.
Settings withCommandLine(Settings settings, const SettingsChoice& choice);

/// The same, and the result checked as a whole. Throws UsageError with one sentence.
Settings checkedWithCommandLine(const Settings& settings, const SettingsChoice& choice);

/// Names of the solvers of the table that run on the processor: what a comparison of all solvers compares.
std::vector<std::string> processorSolvers();

/// Sets one setting from the text of an option. Throws UsageError with one sentence that names the option.
void setFromOption(Settings& settings, std::string_view key, std::string_view value, const std::string& option);

}  // namespace touchstone::app
