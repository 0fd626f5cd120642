#include "haptics/sandbox/scene/placement.hpp"

#include <algorithm>

#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {

glm::dmat4 placeOf(const HapticScene& scene, engine::Entity node, const Pose* X_WT) {
    const engine::Registry& registry = scene.scene.registry;
    const glm::dmat4& placed = registry.get<engine::WorldTransform>(node).matrix;
    const auto along = [&](engine::Entity body, const Pose& X_WB) {
        return toMatrix(X_WB) * glm::inverse(engine::rigidMatrix(engine::worldPose(registry, body))) * placed;
    };
    const SceneRoles& roles = scene.roles;
    if (roles.tool && engine::isBelow(registry, node, roles.tool)) return X_WT ? along(roles.tool, *X_WT) : placed;
    if (!scene.world) return placed;
    for (engine::Entity body = node; body; body = registry.get<engine::Hierarchy>(body).parent) {
        const auto found = std::find(roles.obstacles.begin(), roles.obstacles.end(), body);
        if (found == roles.obstacles.end()) continue;
        const Pose& X_WO = obstaclePose(scene, static_cast<std::size_t>(found - roles.obstacles.begin()));
        return X_WO == toPose(engine::worldPose(registry, body)) ? placed : along(body, X_WO);
    }
    return placed;
}

}  // namespace touchstone::sandbox
