#include "haptics/sandbox/session/device_choice.hpp"

#include <stdexcept>

#include "haptics/hands/motion.hpp"
#include "haptics/sandbox/devices/all_devices.hpp"
#include "haptics/sandbox/record/recording.hpp"

namespace touchstone::sandbox {

namespace {

const DeviceInfo* infoOf(const std::string& choice) {
    return findDevice(std::string_view(choice).substr(0, choice.find(':')), allDevices());
}

/// The text after ':'; empty if there is none.
std::string fileOf(const std::string& choice) {
    const auto colon = choice.find(':');
    return colon == std::string::npos ? "" : choice.substr(colon + 1);
}

}  // namespace

std::optional<std::filesystem::path> recordingOf(const std::string& choice) {
    std::error_code error;
    if (!traitsOf(choice).followsFile) return {};
    std::filesystem::path folder = fileOf(choice);
    if (!std::filesystem::is_directory(folder, error)) return {};
    return folder;
}

Mover moverOf(const std::string& choice) {
    const DeviceInfo* info = infoOf(choice);
    return info ? info->mover : Mover::Nothing;
}

DeviceTraits traitsOf(const std::string& choice) {
    const DeviceInfo* info = infoOf(choice);
    return info ? info->traits : DeviceTraits{};
}

const ExpectedOutcome* outcomeFor(const HapticScene& scene, const std::string& choice) {
    if (!traitsOf(choice).followsMotion) return nullptr;
    if (followsDemonstration(choice)) return &scene.outcome;
    for (std::size_t i = 0; i < scene.motions.size(); ++i)
        if (scene.motions[i].name == fileOf(choice)) return &scene.outcomes[i];
    return nullptr;
}

bool followsDemonstration(const std::string& choice) {
    return traitsOf(choice).followsMotion && choice.find(':') == std::string::npos;
}

std::string defaultDevice(const HapticScene& scene, bool window) {
    return scene.demonstration ? "demo" : window ? "mouse" : "rest";
}

std::unique_ptr<Device> startDevice(const HapticScene& scene, const std::string& choice,
                                    std::shared_ptr<MouseTarget> mouse, const std::optional<Pose>& X_WT_start) {
    if (const auto folder = recordingOf(choice)) return std::make_unique<MotionDevice>(recordedHand(*folder).motion);
    const DeviceInfo* info = infoOf(choice);
    if (!info) {
        const std::string name = choice.substr(0, choice.find(':'));
        std::string names;
        for (const DeviceInfo& device : allDevices()) names += (names.empty() ? "" : ", ") + std::string(device.name);
        throw std::runtime_error("unknown device '" + name + "': choose one of " + names);
    }
    return info->make({.X_WT_start = X_WT_start ? *X_WT_start : startPose(scene),
                       .goal = scene.roles.goal,
                       .demonstration = scene.demonstration,
                       .motions = scene.motions,
                       .mouse = std::move(mouse),
                       .file = fileOf(choice)});
}

}  // namespace touchstone::sandbox
