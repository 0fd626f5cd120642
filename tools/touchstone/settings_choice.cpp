#include "tools/touchstone/settings_choice.hpp"

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
    // The other modes have no friction. A scene's materials have no effect there; asking for it is a mistake.
    for (const std::string& pair : choice.set)
        if (settings.mode != Mode::Default && settings.friction && pair.starts_with("friction="))
            throw UsageError(std::string(modeNames()[static_cast<std::size_t>(settings.mode)]) +
                             " mode is frictionless: leave out --set " + pair + ", or choose --mode default");
    return settings;
}

Settings checkedWithCommandLine(const Settings& settings, const SettingsChoice& choice) {
    const Settings chosen = withCommandLine(settings, choice);
    if (const std::string wrong = checkSettings(chosen); !wrong.empty()) throw UsageError(wrong);
    return chosen;
}

}  // namespace touchstone::app
