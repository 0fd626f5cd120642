#include "haptics/sandbox/app/selection.hpp"

#include <imgui.h>

#include "haptics/sandbox/scene/placement.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {
namespace {

/// The handles of a running tool move the hand that holds it. All other handles move the node itself.
bool isHeld(const HapticScene& scene, engine::Entity node, const ToolPoses& tool) {
    return tool.running && node == scene.roles.tool;
}

}  // namespace

void Selection::select(engine::Entity node) {
    if (node == node_) return;
    *this = {};
    node_ = node;
}

void Selection::click(const HapticScene& scene, const ToolPoses& tool, const engine::Ray& ray) {
    const engine::Entity hit = engine::pickNode(
        scene.scene.registry,
        [&](engine::Entity node) { return placeOf(scene, node, tool.running ? &tool.X_WT : nullptr); }, ray);
    const engine::Entity owner = hit ? roleOwner(scene.scene.registry, hit) : engine::Entity{};
    select(owner ? owner : hit);
}

void Selection::moveTo(const engine::Scene& before, const engine::Scene& after) {
    const int index = node_ ? engine::nodeIndex(before, node_) : -1;
    *this = {};
    if (index >= 0 && static_cast<std::size_t>(index) < after.nodes.size())
        node_ = after.nodes[static_cast<std::size_t>(index)];
}

Selection::Result Selection::update(const engine::MouseFrame& mouse, const engine::OrbitCamera& camera,
                                    HapticScene& scene, const ToolPoses& tool, bool ownAxes, float size, bool snap) {
    place_.reset();
    if (!node_) return {};
    engine::Registry& registry = scene.scene.registry;
    if (!box_) box_ = engine::boxOf(registry, node_);
    const bool held = isHeld(scene, node_, tool);
    if (!held && tool.running && scene.roles.tool && engine::isBelow(registry, node_, scene.roles.tool)) {
        gizmo_.reset();  // a part of the running tool moves with the tool only
        return {};
    }
    engine::GizmoPlace place{.body = held ? toRigidPart(tool.X_WT_device) : engine::worldPose(registry, node_),
                             .pivot = {},
                             .ownAxes = ownAxes,
                             .size = size};
    const engine::RigidPart shown = held ? toRigidPart(tool.X_WT) : place.body;
    const glm::dmat4 drawn =
        held ? placeOf(scene, node_, &tool.X_WT) : registry.get<engine::WorldTransform>(node_).matrix;
    place.pivot =
        glm::inverse(shown.rotation) * (glm::dvec3(drawn * glm::dvec4(box_->center(), 1)) - shown.translation);

    const bool wasDragging = gizmo_.dragging();
    const std::optional<engine::RigidPart> wanted = gizmo_.update(mouse, camera, place, snap);
    if (wanted) place.body = *wanted;
    place_ = place;
    if (held) return {.edit = {}, .hand = wanted ? std::optional(toPose(*wanted)) : std::nullopt};
    if (wanted) {
        auto& local = registry.get<engine::LocalTransform>(node_);
        if (!before_) before_ = local;
        local = engine::placedAt(registry, node_, *wanted);
        updateWorldTransforms(scene.scene);
        return {};
    }
    if (!wasDragging || !before_) return {};
    const engine::PlaceNode moved{engine::nodeIndex(scene.scene, node_), *before_,
                                  registry.get<engine::LocalTransform>(node_)};
    before_.reset();
    if (moved.from == moved.to) return {};
    return {.edit = moved, .hand = {}};
}

void Selection::cancel(HapticScene& scene) {
    gizmo_.reset();
    if (!before_) return;
    scene.scene.registry.get<engine::LocalTransform>(node_) = *before_;
    before_.reset();
    updateWorldTransforms(scene.scene);
}

std::vector<glm::vec3> Selection::corners(const HapticScene& scene, const ToolPoses& tool) const {
    if (!node_) return {};
    // A goal has no extent of its own: that of the tool there.
    if (node_ == scene.roles.goalNode && node_ != scene.roles.tool && scene.roles.goal && scene.roles.tool)
        return engine::boxOf(scene.scene.registry, scene.roles.tool)
            .corners(placeOf(scene, scene.roles.tool, &scene.roles.goal->X_WT));
    const engine::NodeBox box = box_ ? *box_ : engine::boxOf(scene.scene.registry, node_);
    return box.corners(placeOf(scene, node_, tool.running ? &tool.X_WT : nullptr));
}

void Selection::draw(ImDrawList& list, const engine::OrbitCamera& camera, glm::vec2 corner, glm::vec2 viewport,
                     const HapticScene& scene, const ToolPoses& tool) const {
    if (!node_) return;
    const std::vector<glm::vec3> points = corners(scene, tool);
    for (std::size_t i = 0; i < points.size(); ++i)
        for (const std::size_t bit : {1u, 2u, 4u}) {
            if (i & bit) continue;
            const auto a = camera.project(points[i], viewport), b = camera.project(points[i | bit], viewport);
            if (a && b)
                list.AddLine({corner.x + a->x, corner.y + a->y}, {corner.x + b->x, corner.y + b->y},
                             IM_COL32(255, 255, 255, 70), 1.5f);
        }
    if (place_) gizmo_.draw(list, camera, corner, viewport, *place_);
}

}  // namespace touchstone::sandbox
