#pragma once
// From --device NAME[:FILE] to a device.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "haptics/device/device.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// The folder of a choice replay:FOLDER: a recording, where a file is a motion.
std::optional<std::filesystem::path> recordingOf(const std::string& choice);

/// Starts a device of deviceTable() for the scene. `choice`: NAME or NAME:FILE; `mouse`: fed by the window, null
/// without one; `X_WT_start`: where the tool is when it starts, else the scene's start. Throws std::runtime_error with
/// one sentence when there is no such device or it cannot start. Pre: the scene has a tool.
std::unique_ptr<Device> startDevice(const HapticScene& scene, const std::string& choice,
                                    std::shared_ptr<MouseTarget> mouse = nullptr,
                                    const std::optional<Pose>& X_WT_start = {});

}  // namespace touchstone::sandbox
