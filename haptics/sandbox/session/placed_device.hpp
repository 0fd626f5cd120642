#pragma once
// A device in its place in the scene, with the gains that its hand is meant to feel: the same in a window and without.
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "haptics/loop/settings.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/session/message_log.hpp"
#include "haptics/sandbox/session/workspace_file.hpp"

namespace touchstone::sandbox {

using Say = std::function<void(Message::Kind, const std::string&)>;  ///< receives a sentence

/// Places the device as it was saved for this scene; before it is asked for limits or readings. Returns the scale, mm
/// of the tool per mm of the hand. Throws std::runtime_error with one sentence if the file cannot be read.
double placeDevice(DeviceControl* control, const WorkspaceFile& workspaces, const std::filesystem::path& scene,
                   const std::string& choice);

/// Lowers the gains to those that the device is made for, and says each change. `limits`: as felt at the hand.
Settings withinGains(Settings settings, const DeviceLimits& limits, const std::string& choice, const Say& say);

/// Converts settings felt at the hand to the settings of the tick.
Settings inScene(Settings settings, double scale);

struct PlacedDevice {
    std::unique_ptr<Device> device;
    Settings settings;  ///< of its ticks
};
/// Starts the device for a run without a window, as a window does: with the workspace in `configFolder` (empty: none),
/// which is said, and these settings felt at the hand. Throws as startDevice() and placeDevice().
PlacedDevice startPlaced(const HapticScene& scene, const std::string& choice, const Settings& settings,
                         const std::filesystem::path& configFolder, const Say& say);

}  // namespace touchstone::sandbox
