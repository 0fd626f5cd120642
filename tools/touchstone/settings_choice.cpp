#include "tools/touchstone/settings_choice.hpp"

#include "haptics/sandbox/session/presets.hpp"

namespace touchstone::app {
namespace {

void set(Settings& settings, std::string_view key, std::string_view value, const std::string& option) {
    if (const std::string wrong = setSetting(settings, key, value); !wrong.empty())
        throw UsageError(option + ": " + wrong);
}

}  // namespace

Settings withCommandLine(Settings settings, const RunOptions& options) {
    if (options.mode) {
        Settings asked = settings;
        set(asked, "mode", *options.mode, "--mode");
        settings = sandbox::withMode(settings, asked.mode);
    }
    const auto apply = [&](const char* key, const std::optional<std::string>& value) {
        if (value) set(settings, key, *value, std::string("--") + key);
    };
    apply("solver", options.solver);
    apply("shadow", options.shadow);
    apply("tolerance", options.tolerance);
    apply("rate", options.rate);
    for (const std::string& pair : options.set) {
        const auto equals = pair.find('=');
        if (equals == std::string::npos) throw UsageError("--set takes KEY=VALUE, not '" + pair + "'");
        set(settings, pair.substr(0, equals), pair.substr(equals + 1), "--set");
    }
    return settings;
}

Settings settingsOf(const QpCommand& command) {
    RunOptions options;
    options.solver = command.solver;
    options.tolerance = command.tolerance;
    Settings settings = withCommandLine({}, options);
    if (command.mode) set(settings, "mode", *command.mode, "--mode");
    return settings;
}

}  // namespace touchstone::app
