#include "haptics/sandbox/session/presets.hpp"
#include "haptics/loop/setting_table.hpp"

#include <algorithm>
#include <utility>

namespace touchstone::sandbox {

Settings withMode(Settings settings, Mode mode) {
    if (settings.mode == mode) return settings;
    settings.mode = mode;
    settings.solver = mode == Mode::Paper ? "pqp" : kExactSolver;
    settings.shadow = mode == Mode::Default ? "pqp" : kNoSolver;
    settings.tolerance = 0.01;
    return settings;
}

Settings withGeometry(Settings settings, Geometry geometry) {
    settings.geometry = geometry;
    return settings;
}

Settings withSolversSwapped(Settings settings) {
    if (settings.shadow == kNoSolver) return settings;
    std::swap(settings.solver, settings.shadow);
    std::swap(settings.frictionSolver, settings.frictionShadow);
    return settings;
}

std::span<const Preset> presetTable() {
    static constexpr Preset kTable[] = {
        {"default", "The settings of the scene, with the exact solver and pqp as its shadow.",
         [](const Settings& scene) { return withMode(scene, Mode::Default); }},
        {"paper", "The method as published: pqp on the deepest pairs, tolerance 0.01 N·mm, 1 kHz, no shadow.",
         [](const Settings& scene) {
             Settings settings = withMode(scene, Mode::Paper);
             settings.rate = 1000;
             return settings;
         }},
        {"10 kHz", "The default at ten ticks per millisecond, which leaves no time for a shadow.",
         [](const Settings& scene) {
             Settings settings = withMode(scene, Mode::Default);
             settings.rate = 10'000;
             settings.shadow = kNoSolver;
             return settings;
         }},
        {"spheres", "The default, but parts touch by their sphere trees, as in the paper, not by their triangles.",
         [](const Settings& scene) { return withGeometry(withMode(scene, Mode::Default), Geometry::Spheres); }},
    };
    return kTable;
}

std::string commandLine(const std::filesystem::path& file, const std::string& device, const Settings& scene,
                        const Settings& settings) {
    std::string line = "touchstone run " + shellQuoted(file.string()) + " --headless --device " + shellQuoted(device);
    for (const SettingInfo& info : settingTable()) {
        const std::string value = getSetting(settings, info.key);
        if (info.key != "pause" && value != getSetting(scene, info.key))
            line += " --set " + std::string(info.key) + "=" + shellQuoted(value);
    }
    return line;
}

}  // namespace touchstone::sandbox
