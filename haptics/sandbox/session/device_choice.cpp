#include "haptics/sandbox/session/device_choice.hpp"

#include <stdexcept>

#include "haptics/device/motion.hpp"
#include "haptics/sandbox/devices/all_devices.hpp"
#include "haptics/sandbox/record/recording.hpp"

namespace touchstone::sandbox {

std::optional<std::filesystem::path> recordingOf(const std::string& choice) {
    constexpr std::string_view kReplay = "replay:";
    std::error_code error;
    if (!choice.starts_with(kReplay)) return {};
    std::filesystem::path folder = choice.substr(kReplay.size());
    if (!std::filesystem::is_directory(folder, error)) return {};
    return folder;
}

Mover moverOf(const std::string& choice) {
    const DeviceInfo* info = findDevice(choice.substr(0, choice.find(':')), allDevices());
    return info ? info->mover : Mover::Nothing;
}

std::string defaultDevice(const HapticScene& scene, bool window) {
    return scene.demonstration ? "demo" : window ? "mouse" : "rest";
}

std::unique_ptr<Device> startDevice(const HapticScene& scene, const std::string& choice,
                                    std::shared_ptr<MouseTarget> mouse, const std::optional<Pose>& X_WT_start) {
    if (const auto folder = recordingOf(choice)) return std::make_unique<MotionDevice>(recordedHand(*folder).motion);
    const auto colon = choice.find(':');
    const std::string name = choice.substr(0, colon);
    const DeviceInfo* info = findDevice(name, allDevices());
    if (!info) {
        std::string names;
        for (const DeviceInfo& device : allDevices()) names += (names.empty() ? "" : ", ") + std::string(device.name);
        throw std::runtime_error("unknown device '" + name + "': choose one of " + names);
    }
    return info->make({.X_WT_start = X_WT_start ? *X_WT_start : startPose(scene),
                       .goal = scene.roles.goal,
                       .demonstration = scene.demonstration,
                       .motions = scene.motions,
                       .mouse = std::move(mouse),
                       .file = colon == std::string::npos ? "" : choice.substr(colon + 1)});
}

}  // namespace touchstone::sandbox
