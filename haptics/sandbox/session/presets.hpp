#pragma once
// Settings by name, and settings as the command that repeats them.
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "haptics/loop/settings.hpp"

namespace touchstone::sandbox {

/// Settings for a mode: paper renders with pqp at 0.01 without shadow, as published; default with the exact solver,
/// shadowed by pqp; penalty without a solver. All else stays.
Settings withMode(Settings settings, Mode mode);
/// Rendering and shadow solver exchanged; unchanged without a shadow.
Settings withSolversSwapped(Settings settings);

struct Preset {
    std::string_view name, help;
    /// From the settings that the scene asks for.
    Settings (*apply)(const Settings& scene);
};
std::span<const Preset> presetTable();

/// The line for a shell that runs a scene's file with these settings and device, without a window: `touchstone run FILE
/// --headless --device D --set KEY=VALUE ...`, with what differs from the scene's own settings. A pause is left out.
/// Pre: no device that needs the window.
std::string commandLine(const std::filesystem::path& file, const std::string& device, const Settings& scene,
                        const Settings& settings);

/// A word as a POSIX shell reads it back.
std::string shellQuoted(const std::string& word);

}  // namespace touchstone::sandbox
