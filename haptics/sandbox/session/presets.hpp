#pragma once
// Named settings, and the command line that repeats a run with given settings.
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "engine/scene/text.hpp"
#include "haptics/loop/settings.hpp"

namespace touchstone::sandbox {

/// Settings for a mode: paper renders with pqp at tolerance 0.01 without shadow, as published; default with the exact
/// solver and pqp as its shadow; penalty without a solver. Other settings do not change.
Settings withMode(Settings settings, Mode mode);
/// The settings in another geometry.
Settings withGeometry(Settings settings, Geometry geometry);
/// Exchanges rendering and shadow solver, with friction and without; unchanged without a shadow.
Settings withSolversSwapped(Settings settings);

struct Preset {
    std::string_view name, help;
    /// Changes the settings of the scene.
    Settings (*apply)(const Settings& scene);
};
std::span<const Preset> presetTable();

/// The shell command that runs a scene file with these settings and this device, without a window: `touchstone run FILE
/// --headless --device D --set KEY=VALUE ...`, with the settings that differ from the scene's; a pause is left out.
/// Pre: the device does not need a window.
std::string commandLine(const std::filesystem::path& file, const std::string& device, const Settings& scene,
                        const Settings& settings);

using engine::shellQuoted;

}  // namespace touchstone::sandbox
