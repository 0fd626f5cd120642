#include "haptics/sandbox/session/placed_device.hpp"

#include <algorithm>
#include <bit>
#include <cstdio>

#include "haptics/device/control.hpp"
#include "haptics/sandbox/session/device_choice.hpp"

namespace touchstone::sandbox {
namespace {

/// "scale 2, clutch button 1, turned axes": what of a workspace is not the default; empty: nothing.
std::string differences(const Workspace& workspace, DeviceControl::Maps maps) {
    const Workspace usual;
    std::string text;
    const auto add = [&](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
    char number[64];
    if (workspace.q_WD.coeffs() != usual.q_WD.coeffs()) add("turned axes");
    if (maps != DeviceControl::Maps::All) return text;
    if (workspace.scale != usual.scale) {
        std::snprintf(number, sizeof number, "%g mm of the tool per mm of the hand", workspace.scale);
        add(number);
    }
    if (workspace.offset != usual.offset) add("an offset");
    if (workspace.clutch != usual.clutch)
        add(workspace.clutch ? "button " + std::to_string(std::countr_zero(workspace.clutch) + 1) + " as clutch"
                             : "no clutch");
    return text;
}

}  // namespace

double placeDevice(DeviceControl* control, const WorkspaceFile& workspaces, const std::filesystem::path& scene,
                   const std::string& choice) {
    if (!control || control->maps() == DeviceControl::Maps::Nothing) return 1;
    const Workspace workspace = workspaces.load(scene, choice);
    control->setWorkspace(workspace);
    return control->maps() == DeviceControl::Maps::All ? workspace.scale : 1;
}

Settings withinGains(Settings settings, const DeviceLimits& limits, const std::string& choice, const Say& say) {
    const auto cap = [&](double& gain, double most, const char* name, const char* unit) {
        if (gain <= most) return;
        char text[200];
        std::snprintf(text, sizeof text, "The %s device is made for a %s of %g %s, so %g is lowered to that",
                      choice.substr(0, choice.find(':')).c_str(), name, most, unit, gain);
        if (say) say(Message::Kind::Warning, text);
        gain = most;
    };
    cap(settings.stiffness, limits.nominalStiffness, "stiffness", "N/mm");
    cap(settings.torsion, limits.nominalTorsion, "torsion", "mN·m/rad");
    return settings;
}

Settings inScene(Settings settings, double scale) {
    settings.torsion = std::clamp(torsionInScene(settings.torsion, scale), 1.0, 1e6);  // the setting's range
    return settings;
}

PlacedDevice startPlaced(const HapticScene& scene, const std::string& choice, const Settings& settings,
                         const std::filesystem::path& configFolder, const Say& say) {
    std::unique_ptr<Device> device = startDevice(scene, choice);
    const DeviceLimits limits = device->limits();
    const auto control = device->control();
    const double scale = placeDevice(control.get(), WorkspaceFile(configFolder), scene.scene.file, choice);
    if (control && say)
        if (const std::string text = differences(control->workspace(), control->maps()); !text.empty())
            say(Message::Kind::Note, "The workspace that was saved for " + choice + " in this scene: " + text);
    return {std::move(device), inScene(withinGains(settings, limits, choice, say), scale)};
}

}  // namespace touchstone::sandbox
