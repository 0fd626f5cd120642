#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "haptics/sandbox/panels/panels.hpp"
#include "haptics/sandbox/scene/tree_words.hpp"

namespace touchstone::sandbox {
namespace {

const ImVec4 kToolColor{1.00f, 0.78f, 0.35f, 1}, kObstacleColor{0.55f, 0.80f, 1.00f, 1},
    kGoalColor{0.50f, 0.90f, 0.55f, 1}, kGaugeText{0.80f, 0.70f, 1.00f, 1};

ImVec4 roleColor(Role role) {
    switch (role) {
        case Role::Tool:
            return kToolColor;
        case Role::Obstacle:
            return kObstacleColor;
        case Role::Goal:
            return kGoalColor;
        case Role::Gauge:
            return kGaugeText;
        case Role::Visual:
            break;
    }
    return ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled);
}

/// Moves to where `text` fits: beside the name, so that the list has room for more parts, or below it.
void startDetail(const std::string& text) {
    ImGui::SameLine();
    if (ImGui::GetContentRegionAvail().x >= ImGui::CalcTextSize(text.c_str()).x) return;
    ImGui::NewLine();
    ImGui::SetCursorPosX(ImGui::GetCursorPosX() + ImGui::GetFontSize());
}

/// Draws the size of a part's sphere tree and its defects; the tooltip shows the full certificate.
void drawTree(const SphereTree& tree, const std::string& part, engine::ItemRects* items) {
    const TreeCertificate& certificate = tree.certificate;
    const std::string text = std::to_string(tree.leafCount()) + " leaves";
    ImGui::PushStyleColor(
        ImGuiCol_Text, needsAttention(certificate) ? kAttentionColor : ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
    startDetail(text);
    ImGui::BeginGroup();
    ImGui::TextUnformatted(text.c_str());
    if (!certificate.covered) ImGui::TextUnformatted("coverage not proven");
    if (!certificate.closed) ImGui::TextUnformatted("open surface");
    if (certificate.hollow >= 0) ImGui::Text("hollow for balls up to %.2g mm", certificate.hollow);
    ImGui::EndGroup();
    ImGui::PopStyleColor();
    engine::noteItem(items, "tree " + part);
    engine::tooltip(part + ": " + words(tree) + (certificate.note.empty() ? "." : ". " + certificate.note));
}

/// Draws the size of the mesh by which a part is touched; the tooltip shows its features.
void drawMesh(const Surface& surface, const std::string& part, engine::ItemRects* items) {
    const std::string text = std::to_string(surface.features.faces.size()) + " faces";
    startDetail(text);
    ImGui::TextDisabled("%s", text.c_str());
    engine::noteItem(items, "mesh " + part);
    engine::tooltip(part + " is touched by its mesh: " + meshWords(surface) + ".");
}

/// Draws by what a part is touched.
void drawTouched(const HapticScene& scene, Geometry geometry, engine::Entity node, const std::string& text,
                 engine::ItemRects* items) {
    const auto body = bodyOf(scene, node);
    if (!scene.world || !body) return;
    if (touchedByMesh(*scene.world, *body, geometry)) drawMesh(*surfaceOf(scene, node), text, items);
    if (const SphereTree* tree = treeOf(scene, node); tree && touchedBySpheres(*scene.world, *body, geometry))
        drawTree(*tree, text, items);
}

/// `flat`: no node has children, so that no room for their arrows is needed.
void drawNode(HapticScene& whole, Geometry geometry, engine::Entity node, bool flat, ScenePanelState& state,
              engine::ItemRects* items) {
    engine::Scene& scene = whole.scene;
    engine::Registry& registry = scene.registry;
    const auto& children = registry.get<engine::Hierarchy>(node).children;
    const std::string text = nodeText(scene, node);
    ImGui::PushID(static_cast<int>(node.index));

    if (auto* visibility = registry.find<engine::Visibility>(node)) {
        ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {1, 1});
        ImGui::Checkbox("##visible", &visibility->visible);
        ImGui::PopStyleVar();
        engine::noteItem(items, "visible " + text);
        engine::tooltip("Shows this node and all nodes below it.");
        ImGui::SameLine();
    }
    ImGuiTreeNodeFlags flags = ImGuiTreeNodeFlags_OpenOnArrow | ImGuiTreeNodeFlags_SpanAvailWidth;
    if (children.empty()) flags |= ImGuiTreeNodeFlags_Leaf;
    if (state.selected == node) flags |= ImGuiTreeNodeFlags_Selected;
    const Role* role = registry.find<Role>(node);
    const float left = ImGui::GetCursorPosX();
    bool open = false;
    if (flat)
        ImGui::Selectable("##node", state.selected == node, ImGuiSelectableFlags_AllowItemOverlap);
    else
        open = ImGui::TreeNodeEx("##node", flags, "%s", text.c_str());
    engine::noteItem(items, "node " + text);
    if (ImGui::IsItemClicked()) state.selected = node;
    if (flat) {
        ImGui::SameLine(left);
        ImGui::TextUnformatted(text.c_str());
    }
    if (role) {
        ImGui::SameLine();
        ImGui::TextColored(roleColor(*role), "%s", name(*role));
    }
    if (open) ImGui::Unindent();  // further indentation would make the lines too wide
    drawTouched(whole, geometry, node, text, items);
    if (open) ImGui::Indent();
    if (open) {
        for (const engine::Entity child : children) drawNode(whole, geometry, child, flat, state, items);
        ImGui::TreePop();
    }
    ImGui::PopID();
}

const SphereTree* deepestObstacle(const World& world) {
    const SphereTree* deepest = nullptr;
    for (const Obstacle& obstacle : world.obstacles)
        if (const SphereTree* tree = obstacle.part.spheres.get();
            tree && (!deepest || tree->levels.size() > deepest->levels.size()))
            deepest = tree;
    return deepest;
}

void drawLevel(const char* text, const SphereTree* tree, int& level, engine::ItemRects* items) {
    if (!tree) return;
    const int top = static_cast<int>(tree->levels.size()) - 1;
    level = std::clamp(level, -1, top);
    std::array<char, 48> shown{};
    if (level < 0)
        std::snprintf(shown.data(), shown.size(), "none");
    else
        std::snprintf(shown.data(), shown.size(), level == 0 ? "%d leaves" : "%d spheres",
                      tree->levels[static_cast<std::size_t>(level)].count);
    // Positions of the knob from left to right: none, the root, its children, down to the leaves.
    double depth = level < 0 ? 0 : top - level + 1;
    if (engine::drawSlider({.label = text,
                            .help = "Level of the sphere tree to draw: none, or from the root down to the leaves.",
                            .high = top + 1.0,
                            .format = shown.data(),
                            .typed = false},
                           depth, items, text))
        level = depth < 0.5 ? -1 : top + 1 - int(std::lround(depth));
}

void drawDisplay(const HapticScene& scene, bool spheres, DisplayOptions& display, engine::ItemRects* items) {
    ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {2, 1});  // low, so that the list of parts has room
    float width = 0;                                          // of a column
    for (const DisplaySwitch& which : displaySwitches()) width = std::max(width, ImGui::CalcTextSize(which.title).x);
    const ImGuiStyle& style = ImGui::GetStyle();
    width += ImGui::GetFrameHeight() + style.ItemInnerSpacing.x + style.ItemSpacing.x;
    const int columns = std::max(int((ImGui::GetContentRegionAvail().x + style.ItemSpacing.x) / width), 1);
    const float first = ImGui::GetCursorPosX();
    int drawn = 0;
    for (const DisplaySwitch& which : displaySwitches()) {
        if (!which.option && !spheres) continue;
        if (drawn % columns > 0) ImGui::SameLine(first + float(drawn % columns) * width);
        ++drawn;
        bool on = isOn(display, which);
        if (ImGui::Checkbox(which.title, &on)) turn(display, which, on);
        engine::noteItem(items, which.title);
        engine::tooltip(std::string(which.help) + " Key " + which.key + ".");
    }
    ImGui::PopStyleVar();
    if (!scene.world) return;
    if (display.section) {
        ImGui::SetNextItemWidth(9 * ImGui::GetFontSize());
        int axis = display.sectionAxis + 1;
        if (ImGui::Combo("##axis", &axis, "facing you\0normal to x\0normal to y\0normal to z\0"))
            display.sectionAxis = axis - 1;
        engine::noteItem(items, "section axis");
        engine::tooltip("Orientation of the section plane.");
        const double most = scene.world->reach();
        engine::drawSlider({.label = "##section offset",
                            .help = "Distance of the section plane from the contacts, mm toward you.",
                            .low = -most,
                            .high = most,
                            .format = "%.2f mm"},
                           display.sectionOffset, items, "section offset");
    }
    if (!display.trees()) return;
    drawLevel("Tool spheres", scene.world->tool.spheres.get(), display.toolLevel, items);
    drawLevel("Obstacle spheres", deepestObstacle(*scene.world), display.obstacleLevel, items);
}

}  // namespace

std::string nodeText(const engine::Scene& scene, engine::Entity node) {
    const std::string& given = scene.registry.get<engine::Name>(node).value;
    return given.empty() ? "node " + std::to_string(engine::nodeIndex(scene, node)) : engine::printable(given);
}

void drawScenePanel(HapticScene& scene, Geometry geometry, DisplayOptions& display, ScenePanelState& state,
                    engine::ItemRects* items) {
    const bool spheres = display.trees() || !scene.world || touchedBySpheres(*scene.world, 0, geometry);
    const float least = 3 * ImGui::GetFrameHeightWithSpacing();
    ImGui::BeginChild("nodes", {0, std::max(ImGui::GetContentRegionAvail().y - state.below, least)}, true);
    const bool flat = std::ranges::all_of(scene.scene.roots, [&](engine::Entity root) {
        return scene.scene.registry.get<engine::Hierarchy>(root).children.empty();
    });
    for (const engine::Entity root : scene.scene.roots) drawNode(scene, geometry, root, flat, state, items);
    ImGui::EndChild();
    const float top = ImGui::GetCursorPosY();
    ImGui::Separator();
    drawDisplay(scene, spheres, display, items);
    state.below = ImGui::GetCursorPosY() - top;
}

}  // namespace touchstone::sandbox
