#include <imgui.h>

#include <cstdio>

#include "engine/edit/scene_scale.hpp"
#include "haptics/sandbox/panels/panels.hpp"

namespace touchstone::sandbox {
namespace {

/// Nodes that are likely bodies: the roots, or the children of a single root that only groups them.
std::vector<engine::Entity> candidates(const engine::Scene& scene) {
    const engine::Registry& registry = scene.registry;
    const std::vector<engine::Entity>* level = &scene.roots;
    while (level->size() == 1 && !registry.has<engine::MeshInstance>(level->front()) &&
           !registry.get<engine::Hierarchy>(level->front()).children.empty())
        level = &registry.get<engine::Hierarchy>(level->front()).children;
    return *level;
}

}  // namespace

void drawGuide(const HapticScene& scene, engine::Entity selected, PanelRequests& requests, engine::ItemRects* items) {
    const engine::Scene& whole = scene.scene;
    const bool wantsTool = !scene.roles.tool;
    ImGui::TextUnformatted(wantsTool ? "Choose the tool" : "Choose the obstacles");
    ImGui::PushTextWrapPos(0);
    ImGui::TextDisabled("%s", wantsTool ? "Click the part you hold, in this list or in the picture."
                                        : "Click a part that the tool touches, or choose all others.");
    ImGui::PopTextWrapPos();
    const std::vector<engine::Entity> nodes = candidates(whole);
    const Role role = wantsTool ? Role::Tool : Role::Obstacle;
    const auto rows = static_cast<float>(std::min<std::size_t>(nodes.size(), 8));
    ImGui::BeginChild("candidates", {0, (rows + 0.6f) * ImGui::GetTextLineHeightWithSpacing()}, true);
    std::vector<Marking> all;
    for (const engine::Entity node : nodes) {
        if (node == scene.roles.tool) continue;
        const int index = engine::nodeIndex(whole, node);
        const std::string text = nodeText(whole, node);
        ImGui::PushID(index);
        if (ImGui::Selectable(text.c_str(), node == selected)) requests.markings = {GiveRole{index, role}};
        ImGui::PopID();
        engine::noteItem(items, "guide " + text);
        all.emplace_back(GiveRole{index, Role::Obstacle});
    }
    ImGui::EndChild();
    if (selected && selected != scene.roles.tool) {
        const std::string text = (wantsTool ? "Set as tool: " : "Set as obstacle: ") + nodeText(whole, selected);
        if (ImGui::Button(text.c_str(), {-1, 0}))
            requests.markings = {GiveRole{engine::nodeIndex(whole, selected), role}};
        engine::noteItem(items, "guide selected");
    }
    if (!wantsTool) {
        if (ImGui::Button("Set all others as obstacles", {-1, 0})) requests.markings = all;
        engine::noteItem(items, "guide all");
    }
}

bool drawUnitQuestion(const HapticScene& scene, const UnitQuestion& question, PanelRequests& requests,
                      engine::ItemRects* items) {
    ImGui::TextWrapped("%s", question.text.c_str());
    char label[40];
    std::snprintf(label, sizeof label, "Scale the scene by %g", question.scale);
    const bool scale = ImGui::Button(label, {-1, 0});
    engine::noteItem(items, "scale scene");
    engine::tooltip("Scales and moves the nodes at the top of the scene; Ctrl+S writes that into the file.");
    const bool keep = ImGui::Button("Keep this size", {-1, 0});
    engine::noteItem(items, "keep size");
    if (scale) try {
            requests.edits = engine::scaled(scene.scene, question.scale, "touchstone");
        } catch (const engine::SceneError& e) {
            requests.refusal = e.what();
        }
    return scale || keep;
}

}  // namespace touchstone::sandbox
