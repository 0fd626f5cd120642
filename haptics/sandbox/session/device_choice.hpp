#pragma once
// From the text of --device NAME[:FILE] to a device.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "haptics/device/device_table.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// The folder of a choice replay:FOLDER, which is a recording; nothing for replay:FILE, which is a motion.
std::optional<std::filesystem::path> recordingOf(const std::string& choice);

/// What moves the device of a choice; nothing for an unknown device.
Mover moverOf(const std::string& choice);
/// Its other traits; none for an unknown device.
DeviceTraits traitsOf(const std::string& choice);

/// The expected outcome of a run with this device: that of the motion which demo or demo:NAME follows; null for other
/// devices.
const ExpectedOutcome* outcomeFor(const HapticScene& scene, const std::string& choice);
/// Whether the device follows the scene's own demonstration.
bool followsDemonstration(const std::string& choice);

/// The device that moves the tool when the user chose none: the demonstration; without one, in a window the mouse, and
/// else nothing, so that the tool rests at its start.
std::string defaultDevice(const HapticScene& scene, bool window);

/// Starts a device of allDevices() for the scene. `choice`: NAME or NAME:FILE; `mouse`: the target that the window
/// sets, null without a window; `X_WT_start`: tool pose at the start, by default the scene's. Throws std::runtime_error
/// with one sentence if there is no such device or it cannot start. Pre: the scene has a tool.
std::unique_ptr<Device> startDevice(const HapticScene& scene, const std::string& choice,
                                    std::shared_ptr<MouseTarget> mouse = nullptr,
                                    const std::optional<Pose>& X_WT_start = {});

}  // namespace touchstone::sandbox
