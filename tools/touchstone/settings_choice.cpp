#include "tools/touchstone/settings_choice.hpp"

#include "haptics/loop/setting_table.hpp"
#include "haptics/qp/solver.hpp"
#include "haptics/sandbox/session/presets.hpp"

namespace touchstone::app {

void setFromOption(Settings& settings, std::string_view key, std::string_view value, const std::string& option) {
    if (const std::string wrong = setSetting(settings, key, value); !wrong.empty())
        throw UsageError(option + ": " + wrong);
}

Settings withCommandLine(Settings settings, const SettingsChoice& choice) {
    if (choice.mode) {
        Settings chosen = settings;
        setFromOption(chosen, "mode", *choice.mode, "--mode");
        settings = sandbox::withMode(settings, chosen.mode);
    }
    const auto apply = [&](const char* key, const std::optional<std::string>& value) {
        if (value) setFromOption(settings, key, *value, std::string("--") + key);
    };
    apply("geometry", choice.geometry);
    apply("solver", choice.solver);
    apply("shadow", choice.shadow);
    apply("tolerance", choice.tolerance);
    apply("rate", choice.rate);
    for (const std::string& pair : choice.set) {
        const auto equals = pair.find('=');
        if (equals == std::string::npos) throw UsageError("--set takes KEY=VALUE, not '" + pair + "'");
        setFromOption(settings, pair.substr(0, equals), pair.substr(equals + 1), "--set");
    }
    for (const std::string& pair : choice.set)
        if (const std::string wrong = checkAskedFriction(settings, pair.substr(0, pair.find('='))); !wrong.empty())
            throw UsageError("--set " + pair + ": " + wrong);
    return settings;
}

Settings checkedWithCommandLine(const Settings& settings, const SettingsChoice& choice) {
    const Settings chosen = withCommandLine(settings, choice);
    if (const std::string wrong = checkSettings(chosen); !wrong.empty()) throw UsageError(wrong);
    return chosen;
}

std::vector<std::string> processorSolvers() {
    std::vector<std::string> names;
    for (const SolverInfo& solver : solverTable())
        if (!solver.roundTrip) names.emplace_back(solver.name);
    return names;
}

}  // namespace touchstone::app
