#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "haptics/sandbox/panels/panels.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {
namespace {

constexpr int kButtons = 4;  // number of device buttons offered as clutch

void drawLabel(const char* label, const char* help) {
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(label);
    engine::tooltip(help);
    ImGui::SameLine(8.5f * ImGui::GetFontSize());
    ImGui::SetNextItemWidth(-1);
}

/// Asks before a device moves by itself: the first button shows the question, the second one starts the motion.
void drawConsent(const std::string& consent, DevicePanelState& state, PanelRequests& requests,
                 engine::ItemRects* items) {
    state.asksConsent &= !consent.empty();
    if (consent.empty()) return;
    if (!state.asksConsent) {
        state.asksConsent = ImGui::Button("Initialize ...", {-1, 0});
        engine::noteItem(items, "initialize");
        return;
    }
    ImGui::TextWrapped("%s", consent.c_str());
    if (ImGui::Button("Move the arm")) {
        requests.initializeDevice = true;
        state.asksConsent = false;
    }
    engine::noteItem(items, "initialize now");
    ImGui::SameLine();
    if (ImGui::Button("Cancel")) state.asksConsent = false;
    engine::noteItem(items, "initialize cancel");
}

void drawStatus(const DevicePanelView& view, DevicePanelState& state, PanelRequests& requests,
                engine::ItemRects* items) {
    const DeviceStatus status = view.facts.status.value_or(DeviceStatus{});
    using State = DeviceStatus::State;
    const bool running = status.state == State::Running;
    const std::string device = view.device.substr(0, view.device.find(':'));  // its options may be long
    ImGui::TextColored(running ? ImVec4(0.55f, 0.85f, 0.55f, 1) : ImVec4(1, 0.6f, 0.4f, 1), "%s: %s", device.c_str(),
                       name(status.state));
    engine::noteItem(items, "device state");
    ImGui::TextWrapped("%s", status.text.c_str());
    if (status.rate > 0) ImGui::Text("Scheduler rate: %.0f Hz", status.rate);
    if (status.temperature >= 0) {
        drawLabel(
            "Warmest motor",
            "Temperature of the warmest motor as the device reports it. At 100 % the device switches its motors off.");
        std::array<char, 32> shown{};
        std::snprintf(shown.data(), shown.size(), "%.0f %%", 100 * status.temperature);
        ImGui::ProgressBar(static_cast<float>(status.temperature), {-1, 0}, shown.data());
        engine::noteItem(items, "device temperature");
    }
    drawConsent(status.consent, state, requests, items);
    ImGui::BeginDisabled(status.state == State::Connecting);
    if (ImGui::Button("Reconnect", {-1, 0})) requests.reconnect = true;
    engine::noteItem(items, "reconnect");
    engine::tooltip(
        "Closes and reopens the device. The force stays zero until you engage the device, and the tool keeps its "
        "pose.");
    ImGui::EndDisabled();
    if (!status.details.empty() && ImGui::TreeNode("Details")) {
        ImGui::TextWrapped("%s", status.details.c_str());
        ImGui::TreePop();
    }
}

/// Returns true when the user has finished a change of `workspace`. An unfinished change is kept in `state`.
bool drawWorkspace(Workspace& workspace, DevicePanelState& state, engine::ItemRects* items) {
    if (state.edited) workspace = *state.edited;
    bool done = false, editing = false;
    const auto follow = [&] {
        editing |= ImGui::IsItemActive();
        done |= ImGui::IsItemDeactivatedAfterEdit();
    };

    engine::drawSlider({.label = "Scale",
                        .help = "Ratio of tool motion to hand motion. Forces are scaled back, so the hand feels the "
                                "gains as set. After a change the force fades, and the hand then takes up the tool "
                                "again.",
                        .low = 0.1,  // usual tuning range
                        .high = 10,
                        .logarithmic = true},
                       workspace.scale, items, "device scale");
    follow();
    glm::dvec3 offset = toGlm(workspace.offset);
    engine::drawTriple("Offset", "mm", offset, 0.2f,
                       "Offset of the tool from where the hand took it up at the start, in scene axes. The tool glides "
                       "to a new offset.",
                       items, "device offset");
    workspace.offset = Vec3(offset.x, offset.y, offset.z);
    follow();

    drawLabel("Clutch", "While this button is held, the hand moves and the tool does not.");
    const auto buttonText = [](int number) {
        return number == 0 ? std::string("none") : "button " + std::to_string(number);
    };
    int chosen = 0;
    for (int i = 1; i <= kButtons; ++i)
        if (workspace.clutch == 1u << (i - 1)) chosen = i;
    if (ImGui::BeginCombo("##clutch", buttonText(chosen).c_str())) {
        for (int i = 0; i <= kButtons; ++i)
            if (ImGui::Selectable(buttonText(i).c_str(), i == chosen)) {
                workspace.clutch = i == 0 ? 0 : 1u << (i - 1);
                done = true;
            }
        ImGui::EndCombo();
    }
    engine::noteItem(items, "device clutch");
    if (editing && !done)
        state.edited = workspace;
    else
        state.edited.reset();
    return done;
}

/// Returns true when `workspace` was changed.
bool drawAxes(Workspace& workspace, PanelRequests& requests, engine::ItemRects* items) {
    const float half = 0.5f * (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x);
    if (ImGui::Button("Align with view", {half, 0})) requests.alignWithView = true;
    engine::noteItem(items, "device view axes");
    engine::tooltip(
        "Aligns the device's axes with the current view: right, up and toward you mean the same at the device and in "
        "the picture.");
    ImGui::SameLine();
    const bool toScene = ImGui::Button("Align with scene", {half, 0});
    if (toScene) workspace.q_WD.setIdentity();
    engine::noteItem(items, "device scene axes");
    return toScene;
}

}  // namespace

void drawDevicePanel(const DevicePanelView& view, DevicePanelState& state, PanelRequests& requests,
                     engine::ItemRects* items) {
    if (!view.trouble.empty()) {
        ImGui::TextColored({1, 0.6f, 0.4f, 1}, "The selected device did not start.");
        ImGui::TextWrapped("%s", view.trouble.c_str());
        engine::noteItem(items, "device trouble");
        ImGui::Separator();
    }
    if (!view.control) return;
    drawStatus(view, state, requests, items);
    using Maps = DeviceControl::Maps;
    const Maps maps = view.control->maps();
    if (maps == Maps::Nothing) return;

    if (maps == Maps::All) {
        const DeviceLimits& limits = view.facts.limits;
        ImGui::Spacing();
        ImGui::TextDisabled("Gains and limits at the hand");
        ImGui::Text("%.4g N/mm, %.4g mN·m/rad", view.settings.stiffness, view.settings.torsion);
        if (limits.torque) {
            ImGui::TextDisabled("peak: %.3g N, %.3g mN·m", limits.peakForce, limits.peakTorque);
            ImGui::TextDisabled("continuous: %.3g N, %.3g mN·m", limits.continuousForce, limits.continuousTorque);
        } else {
            ImGui::TextDisabled("peak: %.3g N, continuous: %.3g N", limits.peakForce, limits.continuousForce);
            ImGui::TextDisabled("force only: this device has no torque");
        }
    }
    ImGui::Spacing();
    ImGui::TextDisabled("Workspace mapping");
    Workspace workspace = view.control->workspace();
    bool done = maps == Maps::All && drawWorkspace(workspace, state, items);
    done |= drawAxes(workspace, requests, items);
    if (done) {
        workspace.scale = std::clamp(workspace.scale, kSmallestScale, kLargestScale);
        requests.workspace = workspace;
    }
}

}  // namespace touchstone::sandbox
