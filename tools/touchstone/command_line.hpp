#pragma once
// What the commands share when they add their options to the command line.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "haptics/loop/setting_table.hpp"
#include "haptics/math/numbers.hpp"
#include "tools/touchstone/commands.hpp"

namespace touchstone::app {

/// A new command below `parent`. `footer` holds its examples; CLI11 would otherwise repeat those of the parent.
inline CLI::App* addCommand(CLI::App& parent, const char* name, const char* summary, const char* footer) {
    CLI::App* command = parent.add_subcommand(name, summary);
    command->footer(footer);
    return command;
}

/// The names of a table's rows, comma-separated.
template <class Table>
std::string namesOf(const Table& table) {
    std::string names;
    for (const auto& row : table) names += (names.empty() ? "" : ", ") + std::string(row.name);
    return names;
}

/// Checks that an option is a number from min to max. Settings have their ranges in settingTable() instead.
inline CLI::Validator within(double min, double max, const char* unit = "") {
    const std::string range = rangeWords(min, max, unit);
    return CLI::Validator(
        [=](const std::string& text) {
            return readNumber(text, min, max) ? "" : "must be " + range + ", not '" + text + "'";
        },
        "");
}

/// The duration of a run: from one tick at the highest rate to more than anyone waits for, s.
inline CLI::Validator durationInSeconds() { return within(1e-4, 1e6, "s"); }

/// The scale of text and controls, for commands that open a window.
inline void addUiScale(CLI::App& command, std::optional<float>& scale) {
    command
        .add_option("--ui-scale", scale,
                    "size of text and controls in the window, 1 for 96 dots per inch (default: as the monitor says)")
        ->check(within(0.5, 4));
}

/// --set KEY=VALUE, any number of times, and --KEY VALUE, which the help does not list, for every setting that has no
/// option of its own yet. The words of KEY may also be joined by dashes, like those of other options.
inline void addSet(CLI::App& command, std::vector<std::string>& set, const char* help) {
    command.add_option("--set", set, help)->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    std::vector<std::string> keys;
    for (const SettingInfo& info : settingTable()) keys.emplace_back(info.key);
    for (const EarlierKey& key : earlierSettingKeys()) keys.emplace_back(key.earlier);
    for (const std::string& key : keys) {
        if (command.get_option_no_throw("--" + key)) continue;
        std::string names = "--" + key, dashed = names;
        std::replace(dashed.begin(), dashed.end(), '_', '-');
        if (dashed != names && !command.get_option_no_throw(dashed)) names += "," + dashed;
        // CLI11 goes through the options in their order, so those of --set are there by then; they come last and win.
        command
            .add_option_function<std::string>(
                names, [&set, key](const std::string& value) { set.insert(set.begin(), key + "=" + value); }, "")
            ->group("");
    }
}

/// Where the scenes of recordings are.
inline void addRecordedScene(CLI::App& command, std::filesystem::path& scene) {
    command.add_option("--scene", scene,
                       "the scene of the recording, or the folder that holds it (default: in the recording's folder, "
                       "beside it, where it was, or a bundled scene; the content decides)");
}

inline constexpr const char* kSceneHelp = "a .glb or .gltf file, or the name of a bundled scene";
inline constexpr const char* kToleranceHelp = "tolerance of an approximate solver: N, in paper mode N·mm";
inline constexpr const char* kRecordingHelp = "folder that `touchstone run --record` wrote";

}  // namespace touchstone::app
