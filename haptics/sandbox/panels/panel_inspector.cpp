#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#define GLM_ENABLE_EXPERIMENTAL
#include <glm/gtx/euler_angles.hpp>

#include "haptics/sandbox/panels/panels.hpp"
#include "haptics/sandbox/scene/friction.hpp"
#include "haptics/sandbox/scene/tree_words.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "haptics/sandbox/session/goal_edit.hpp"

namespace touchstone::sandbox {
namespace {

constexpr Role kRoles[]{Role::Tool, Role::Obstacle, Role::Goal, Role::Gauge, Role::Visual};

float labelWidth() { return 6.5f * ImGui::GetFontSize(); }

/// Draws the label of the next control, which fills the rest of the line.
void drawLabel(const char* text) {
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(text);
    ImGui::SameLine(labelWidth());
    ImGui::SetNextItemWidth(-1);
}

std::size_t triangleCount(const engine::Registry& registry, engine::Entity node) {
    std::size_t count = 0;
    if (const auto* instance = registry.find<engine::MeshInstance>(node))
        for (const engine::Primitive& primitive : instance->primitives) count += primitive.mesh->indices.size() / 3;
    for (const engine::Entity child : registry.get<engine::Hierarchy>(node).children)
        count += triangleCount(registry, child);
    return count;
}

/// Collects the materials of the meshes at and below a node, each once.
void collectMaterials(const engine::Registry& registry, engine::Entity node, std::vector<int>& materials) {
    if (const auto* instance = registry.find<engine::MeshInstance>(node))
        for (const engine::Primitive& primitive : instance->primitives)
            if (primitive.material >= 0 &&
                std::find(materials.begin(), materials.end(), primitive.material) == materials.end())
                materials.push_back(primitive.material);
    for (const engine::Entity child : registry.get<engine::Hierarchy>(node).children)
        collectMaterials(registry, child, materials);
}

void drawRole(const HapticScene& scene, engine::Entity node, int index, PanelRequests& requests,
              engine::ItemRects* items) {
    const Role* role = scene.scene.registry.find<Role>(node);
    drawLabel("Role");
    if (ImGui::BeginCombo("##role", role ? name(*role) : "no role")) {
        for (const Role choice : kRoles) {
            if (ImGui::Selectable(name(choice), role && *role == choice) && !(role && *role == choice))
                requests.markings = {GiveRole{index, choice}};
            engine::noteItem(items, std::string("role ") + name(choice));
        }
        if (ImGui::Selectable("no role", !role) && role) requests.markings = {GiveRole{index, std::nullopt}};
        ImGui::EndCombo();
    }
    engine::noteItem(items, "role");
    engine::tooltip(
        "Role of this node and all nodes below it: the tool moves with the hand, obstacles are fixed, and the goal is "
        "where the tool must come to rest. A new role reloads the scene.");
}

void drawPlace(const HapticScene& scene, engine::Entity node, int index, InspectorState& state, PanelRequests& requests,
               engine::ItemRects* items) {
    const auto& local = scene.scene.registry.get<engine::LocalTransform>(node);
    if (!state.placing) {
        state.position = kMmPerMeter * local.translation;
        // The turn about the vertical comes first, so that one number turns an upright part.
        glm::extractEulerAngleYXZ(glm::mat4_cast(local.rotation), state.angles.y, state.angles.x, state.angles.z);
        constexpr double kShown = 1e-6;  // rad: smaller angles are rounding errors
        for (int k = 0; k < 3; ++k)
            state.angles[k] = std::abs(state.angles[k]) < kShown ? 0 : glm::degrees(state.angles[k]);
    }
    bool done = false, active = false;
    const auto draw = [&](const char* label, const char* unit, glm::dvec3& values, float speed, const char* help,
                          const char* name) {
        engine::drawTriple(label, unit, values, speed, help, items, name);
        done |= ImGui::IsItemDeactivatedAfterEdit();
        active |= ImGui::IsItemActive();
    };
    draw("Position", "mm", state.position, 0.1f, "In the parent's frame. Drag, or Ctrl+click to type.", "position");
    draw("Rotation", "degrees", state.angles, 0.5f,
         "First about y, then about the rotated x, then about the rotated z. Drag, or Ctrl+click to type.", "rotation");
    state.placing = active;
    if (done) {
        engine::LocalTransform to = local;
        to.translation = state.position / kMmPerMeter;
        const glm::dvec3 a = glm::radians(state.angles);
        to.rotation = glm::normalize(glm::quat_cast(glm::eulerAngleYXZ(a.y, a.x, a.z)));
        if (to != local) requests.edits = {engine::PlaceNode{index, local, to}};
    }
    if (node == scene.roles.tool && scene.demonstration) {
        ImGui::PushTextWrapPos(0);
        ImGui::TextDisabled("The demonstration starts at another pose.");
        ImGui::PopTextWrapPos();
    }
}

void drawTree(const HapticScene& scene, engine::Entity node, int index, InspectorState& state, PanelRequests& requests,
              engine::ItemRects* items) {
    const BodyMarking* body = scene.scene.registry.find<BodyMarking>(node);
    if (!body) return;
    ImGui::Separator();
    if (!state.choosing) state.tree = body->tree;
    bool byError = state.tree.maxError > 0;
    drawLabel("Tree limit");
    if (ImGui::BeginCombo("##by", byError ? "error" : "leaf count")) {
        if (ImGui::Selectable("leaf count", !byError)) state.tree.maxError = 0;
        engine::noteItem(items, "tree by leaves");
        if (ImGui::Selectable("error", byError) && !byError) {
            const SphereTree* tree = treeOf(scene, node);
            state.tree.maxError = tree ? std::clamp(tree->certificate.protrusion, kMinError, kMaxError) : 0.1;
        }
        engine::noteItem(items, "tree by error");
        ImGui::EndCombo();
    }
    engine::noteItem(items, "tree by");
    engine::tooltip("The sphere tree is limited by its leaf count, or has as few leaves as a maximum error allows.");
    byError = state.tree.maxError > 0;
    drawLabel(byError ? "Max. error" : "Max. leaves");
    if (byError) {
        ImGui::InputDouble("##error", &state.tree.maxError, 0, 0, "%.4g mm");
        state.tree.maxError = std::clamp(state.tree.maxError, kMinError, kMaxError);
        engine::tooltip("Maximum protrusion of a leaf beyond the surface, mm.");
    } else {
        ImGui::InputInt("##leaves", &state.tree.leaves, 0);
        state.tree.leaves = std::clamp(state.tree.leaves, kMinLeaves, TreeOptions::kMaxLeaves);
        engine::tooltip(
            "Maximum leaf count. More leaves follow the surface more closely, but take longer to build and to query.");
    }
    engine::noteItem(items, byError ? "error" : "leaves");
    drawLabel("Quality");
    int quality = int(state.tree.quality), interior = int(state.tree.interior);
    if (ImGui::Combo("##quality", &quality, kQualityNames.data(), int(kQualityNames.size())))
        state.tree.quality = TreeQuality(quality);
    engine::noteItem(items, "quality");
    engine::tooltip("best fits more tightly at the same leaf count and takes several times as long to build.");
    drawLabel("Interior");
    if (ImGui::Combo("##interior", &interior, kInteriorNames.data(), int(kInteriorNames.size())))
        state.tree.interior = Interior(interior);
    engine::noteItem(items, "interior");
    engine::tooltip(
        "shell: the leaves cover the surface. solid: they also fill the part, so that a small tool cannot get inside.");

    state.choosing = !(state.tree == body->tree);
    ImGui::BeginDisabled(!state.choosing);
    if (ImGui::Button("Build tree", {-1, 0})) {
        requests.markings = {ChooseTree{index, state.tree}};
        state.choosing = false;
    }
    engine::noteItem(items, "build tree");
    engine::tooltip(
        "Builds the tree in the background. The running scene keeps the old tree until the new one is ready.");
    ImGui::EndDisabled();
    if (const SphereTree* tree = treeOf(scene, node)) {
        const bool attention = needsAttention(tree->certificate);
        ImGui::PushTextWrapPos(0);
        ImGui::PushStyleColor(ImGuiCol_Text,
                              attention ? kAttentionColor : ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
        ImGui::Text("%d leaves, protrusion at most %s; %s", tree->leafCount(),
                    protrusionWords(tree->certificate).c_str(), surfaceWords(tree->certificate).c_str());
        ImGui::PopStyleColor();
        ImGui::PopTextWrapPos();
        engine::noteItem(items, "tree words");
    }
}

/// Draws by what a part is touched, and the options of its sphere tree if that is used.
void drawTouched(const HapticScene& scene, Geometry geometry, engine::Entity node, int index, InspectorState& state,
                 PanelRequests& requests, engine::ItemRects* items) {
    const auto body = bodyOf(scene, node);
    const bool known = scene.world && body;
    if (known && touchedByMesh(*scene.world, *body, geometry)) {
        ImGui::Separator();
        ImGui::PushTextWrapPos(0);
        ImGui::TextDisabled("Touched by its mesh: %s", meshWords(*surfaceOf(scene, node)).c_str());
        ImGui::PopTextWrapPos();
        engine::noteItem(items, "mesh words");
    }
    if (known && *body < scene.repairs.size() && !scene.repairs[*body].empty()) {
        ImGui::PushTextWrapPos(0);
        ImGui::TextDisabled("Repaired: %s", scene.repairs[*body].c_str());
        ImGui::PopTextWrapPos();
        engine::noteItem(items, "repairs");
    }
    if (known && !touchedBySpheres(*scene.world, *body, geometry)) return;
    drawTree(scene, node, index, state, requests, items);
    if (known && geometry == Geometry::Mesh && *body < scene.defects.size() && !scene.defects[*body].empty()) {
        ImGui::PushTextWrapPos(0);
        ImGui::TextColored(kAttentionColor, "Touched by its spheres, not its mesh, which has %s",
                           scene.defects[*body].c_str());
        ImGui::PopTextWrapPos();
        engine::noteItem(items, "defects");
    }
}

void drawFriction(const HapticScene& scene, engine::Entity node, int index, InspectorState& state,
                  PanelRequests& requests, engine::ItemRects* items) {
    const BodyMarking* body = scene.scene.registry.find<BodyMarking>(node);
    if (!body) return;
    const auto choose = [&](const std::optional<engine::FrictionMaterial>& friction) {
        requests.markings = {ChooseFriction{index, friction}};
    };
    ImGui::Separator();
    bool hasFriction = body->friction.has_value();
    if (ImGui::Checkbox("Friction", &hasFriction))
        choose(hasFriction ? std::optional(engine::FrictionMaterial{engine::kDefaultFriction, engine::kDefaultFriction,
                                                                    engine::FrictionCombine::Average})
                           : std::nullopt);
    engine::noteItem(items, "friction");
    engine::tooltip("Gives this part a material with Coulomb friction. A pair of parts has friction if both have one.");
    if (!body->friction) return;
    const engine::FrictionMaterial& now = body->friction->values;
    const std::string help = frictionHelp(scene, node);
    if (!state.editingFriction) state.friction = {now.staticOr(), now.dynamicOr()};
    state.editingFriction = false;
    const auto drawCoefficient = [&](const char* label, const char* id, double& value, const char* text) {
        constexpr double kLow = 0, kHigh = engine::kMaxFriction;
        drawLabel(label);
        ImGui::DragScalar(id, ImGuiDataType_Double, &value, 0.005f, &kLow, &kHigh, "%.3g",
                          ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_NoRoundToFormat);
        const bool done = ImGui::IsItemDeactivatedAfterEdit();
        state.editingFriction |= ImGui::IsItemActive();
        engine::noteItem(items, id + 2);
        engine::tooltip((text + (" Drag, or Ctrl+click to type." + help)).c_str());
        return done;
    };
    if (drawCoefficient(
            "Static", "##static friction", state.friction.x,
            "Coefficient of friction of a contact that sticks. The dynamic coefficient is used if it is larger."))
        choose(engine::FrictionMaterial{.staticFriction = state.friction.x});
    if (drawCoefficient("Dynamic", "##dynamic friction", state.friction.y,
                        "Coefficient of friction of a contact that slides."))
        choose(engine::FrictionMaterial{.dynamicFriction = state.friction.y});
    drawLabel("Combine");
    if (ImGui::BeginCombo("##combine", name(now.combineOr()))) {
        for (std::size_t k = 0; k < engine::kFrictionCombineNames.size(); ++k) {
            const auto rule = engine::FrictionCombine(k);
            if (ImGui::Selectable(name(rule), rule == now.combineOr()) && rule != now.combineOr())
                choose(engine::FrictionMaterial{.frictionCombine = rule});
            engine::noteItem(items, std::string("combine ") + name(rule));
        }
        ImGui::EndCombo();
    }
    engine::noteItem(items, "combine");
    engine::tooltip(
        "How the coefficients of this part and of the one it touches become those of the pair. If the two "
        "parts differ, average comes before minimum, maximum and multiply." +
        help);
    if (node != scene.roles.tool && scene.roles.tool) {
        ImGui::PushTextWrapPos(0);
        ImGui::TextDisabled("With the tool: %s",
                            frictionWords(scene.scene.registry.get<BodyMarking>(scene.roles.tool), *body).c_str());
        ImGui::PopTextWrapPos();
        engine::noteItem(items, "friction words");
    }
}

/// Draws the tolerances of the goal that this node has.
void drawGoal(const HapticScene& scene, engine::Entity node, InspectorState& state, PanelRequests& requests,
              engine::ItemRects* items) {
    if (!scene.roles.goal || node != scene.roles.goalNode) return;
    ImGui::Separator();
    if (!state.editingGoal) state.goal = *scene.roles.goal;
    state.editingGoal = false;
    bool done = false;
    const auto drawValue = [&](const char* label, const char* id, double& value, double scale, double most, float speed,
                               const char* format, const char* help) {
        double shown = scale * value;
        const double least = 0;
        drawLabel(label);
        if (ImGui::DragScalar(id, ImGuiDataType_Double, &shown, speed, &least, &most, format,
                              ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_NoRoundToFormat))
            value = shown / scale;
        done |= ImGui::IsItemDeactivatedAfterEdit();
        state.editingGoal |= ImGui::IsItemActive();
        engine::noteItem(items, id + 2);
        engine::tooltip(std::string(help) + " Drag, or Ctrl+click to type.");
    };
    constexpr double kDegreesPerRadian = 57.29577951308232;
    drawValue("Tolerance", "##goal tolerance", state.goal.tolerance, 1, 1e3, 0.01f, "%.3g mm",
              "How near the tool's origin must be to the goal, mm.");
    drawValue("Angle", "##goal angle", state.goal.toleranceAngle, kDegreesPerRadian, 360, 0.1f, "%.3g°",
              "How far the tool may be turned from the goal, degrees.");
    drawValue("Hold", "##goal hold", state.goal.hold, 1e-3, 60, 0.01f, "%.2f s",
              "How long the tool must stay there, s.");
    drawValue("Depth", "##goal depth", state.goal.depth, 1, 1e3, 0.05f, "%.3g mm",
              "Depth of the hole: the distance along the way out from the goal to its mouth, mm; 0 if unknown.");
    if (done) requests.edits = {goalWith(scene, state.goal)};
}

/// Conversion of one color channel between linear light and sRGB.
float toScreen(float linear) {
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}
float toLinear(float screen) {
    return screen <= 0.04045f ? screen / 12.92f : std::pow((screen + 0.055f) / 1.055f, 2.4f);
}

void drawMaterial(const engine::Material& material, int index, PanelRequests& requests, engine::ItemRects* items) {
    const auto note = [&](const char* what, const char* help) {
        engine::noteItem(items, std::string(what) + " " + std::to_string(index));
        engine::tooltip(help);
    };
    const engine::Looks now = engine::looksOf(material);
    engine::Looks looks = now;
    ImGui::PushID(index);
    glm::vec3 color{toScreen(now.baseColor.r), toScreen(now.baseColor.g), toScreen(now.baseColor.b)};
    if (ImGui::ColorEdit3("##color", &color.x, ImGuiColorEditFlags_NoInputs))
        looks.baseColor = {toLinear(color.r), toLinear(color.g), toLinear(color.b), now.baseColor.a};
    note("color", "Base color. A texture multiplies it.");
    ImGui::SameLine();
    ImGui::AlignTextToFramePadding();
    ImGui::Text("%s%s", material.name.empty() ? "material" : engine::printable(material.name).c_str(),
                material.texture >= 0 ? ", textured" : "");
    engine::noteItem(items, "material " + std::to_string(index));
    const auto drawFactor = [&](const char* label, const char* what, float& value, const char* help) {
        double factor = value;
        if (engine::drawSlider({.label = label, .help = help, .format = "%.2f"}, factor, items,
                               std::string(what) + " " + std::to_string(index)))
            value = std::clamp(static_cast<float>(factor), 0.f, 1.f);
    };
    drawFactor("Metallic", "metallic", looks.metallic,
               "0: plastic, wood, stone. 1: metal, which tints its reflections.");
    drawFactor("Roughness", "roughness", looks.roughness, "0: a mirror. 1: chalk.");
    ImGui::PopID();
    if (!(looks == now)) requests.edits = {engine::PaintMaterial{index, now, looks}};
}

void drawLooks(const HapticScene& scene, engine::Entity node, PanelRequests& requests, engine::ItemRects* items) {
    std::vector<int> materials;
    collectMaterials(scene.scene.registry, node, materials);
    ImGui::Separator();
    ImGui::TextDisabled("%zu triangles", triangleCount(scene.scene.registry, node));
    for (const int index : materials)
        drawMaterial(scene.scene.materials[static_cast<std::size_t>(index)], index, requests, items);
}

void drawName(const HapticScene& scene, engine::Entity node, int index, InspectorState& state, PanelRequests& requests,
              engine::ItemRects* items) {
    const std::string& now = scene.scene.registry.get<engine::Name>(node).value;
    if (!state.naming) {
        state.name.fill(0);
        now.copy(state.name.data(), state.name.size() - 1);
    }
    ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x - 5 * ImGui::GetFontSize());
    ImGui::InputTextWithHint("##name", nodeText(scene.scene, node).c_str(), state.name.data(), state.name.size());
    state.naming = ImGui::IsItemActive();
    if (ImGui::IsItemDeactivatedAfterEdit() && now != state.name.data())
        requests.edits = {engine::RenameNode{index, now, state.name.data()}};
    engine::noteItem(items, "name");
    engine::tooltip("Name of this node.");
}

}  // namespace

std::string frictionHelp(const HapticScene& scene, engine::Entity part) {
    const engine::Registry& registry = scene.scene.registry;
    const PartFriction& friction = *registry.get<BodyMarking>(part).friction;
    std::string others;
    const auto note = [&](engine::Entity other) {
        const BodyMarking* body = other ? registry.find<BodyMarking>(other) : nullptr;
        if (friction.material >= 0 && other != part && body && body->friction &&
            body->friction->material == friction.material)
            others += (others.empty() ? "" : ", ") + nodeText(scene.scene, other);
    };
    note(scene.roles.tool);
    for (const engine::Entity obstacle : scene.roles.obstacles) note(obstacle);
    return "\nStored in " + sourceOf(scene.scene, part, friction) + "." +
           (others.empty() ? "" : " Other parts share this material: an edit changes " + others + " too.") +
           "\nAn edit reloads the scene.";
}

void drawInspector(HapticScene& scene, Geometry geometry, engine::Entity node, InspectorState& state,
                   PanelRequests& requests, engine::ItemRects* items) {
    if (state.node != node) {
        const bool ownAxes = state.ownAxes;
        state = {};
        state.node = node;
        state.ownAxes = ownAxes;
    }
    const int index = engine::nodeIndex(scene.scene, node);
    drawName(scene, node, index, state, requests, items);
    if (auto* visibility = scene.scene.registry.find<engine::Visibility>(node)) {
        ImGui::SameLine(ImGui::GetContentRegionMax().x - 4.6f * ImGui::GetFontSize());
        ImGui::Checkbox("Show", &visibility->visible);
        engine::noteItem(items, "shown");
        engine::tooltip("Shows this node and all nodes below it.");
    }
    drawRole(scene, node, index, requests, items);
    drawPlace(scene, node, index, state, requests, items);
    drawGoal(scene, node, state, requests, items);
    ImGui::Checkbox("Local axes", &state.ownAxes);
    engine::noteItem(items, "own axes");
    engine::tooltip("Aligns the handles in the picture with the node's axes instead of the scene's.\nKey E");
    ImGui::SameLine();
    if (ImGui::Button("Frame selected")) requests.frameSelection = true;
    engine::noteItem(items, "frame");
    engine::tooltip("Moves the camera so that the node fills the view.\nKey F");
    drawTouched(scene, geometry, node, index, state, requests, items);
    drawFriction(scene, node, index, state, requests, items);
    drawLooks(scene, node, requests, items);
}

}  // namespace touchstone::sandbox
