#include "haptics/sandbox/edit/pick.hpp"

#include <algorithm>
#include <limits>

#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {
namespace {

using engine::Entity;

/// Distance along the ray to a triangle seen from either side; infinity if it misses.
/// Source: Möller and Trumbore, Fast, Minimum Storage Ray-Triangle Intersection (1997).
float meet(const glm::vec3& origin, const glm::vec3& d, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
    constexpr float kMiss = std::numeric_limits<float>::infinity();
    const glm::vec3 ab = b - a, ac = c - a, p = glm::cross(d, ac), s = origin - a;
    const float det = glm::dot(ab, p);
    if (det == 0) return kMiss;
    const float u = glm::dot(s, p) / det;
    const glm::vec3 q = glm::cross(s, ab);
    const float v = glm::dot(d, q) / det, t = glm::dot(ac, q) / det;
    return u >= 0 && v >= 0 && u + v <= 1 && t > 0 ? t : kMiss;
}

}  // namespace

glm::dmat4 placeOf(const HapticScene& scene, Entity node, const Pose* X_WT) {
    const engine::Registry& registry = scene.scene.registry;
    const glm::dmat4& placed = registry.get<engine::WorldTransform>(node).matrix;
    const auto along = [&](Entity body, const Pose& X_WB) {
        return toMatrix(X_WB) * glm::inverse(engine::rigidMatrix(engine::worldPose(registry, body))) * placed;
    };
    const SceneRoles& roles = scene.roles;
    if (roles.tool && engine::isBelow(registry, node, roles.tool)) return X_WT ? along(roles.tool, *X_WT) : placed;
    if (!scene.world) return placed;
    for (Entity body = node; body; body = registry.get<engine::Hierarchy>(body).parent) {
        const auto found = std::find(roles.obstacles.begin(), roles.obstacles.end(), body);
        if (found == roles.obstacles.end()) continue;
        const Pose& X_WO = scene.world->obstacles[static_cast<std::size_t>(found - roles.obstacles.begin())].X_WO;
        return X_WO == toPose(engine::worldPose(registry, body)) ? placed : along(body, X_WO);
    }
    return placed;
}

Entity pickNode(const HapticScene& scene, const Pose* X_WT, const engine::Ray& ray) {
    const engine::Registry& registry = scene.scene.registry;
    Entity nearest;
    float distance = std::numeric_limits<float>::infinity();
    registry.each<engine::MeshInstance>([&](Entity node, const engine::MeshInstance& instance) {
        if (!engine::isVisible(registry, node)) return;
        // In the mesh's frame, with the direction unscaled: distances along the ray stay those of the scene.
        const glm::dmat4 inverse = glm::inverse(placeOf(scene, node, X_WT));
        const glm::vec3 origin(inverse * glm::dvec4(ray.origin, 1)), d(inverse * glm::dvec4(ray.direction, 0));
        for (const engine::Primitive& primitive : instance.primitives) {
            const engine::MeshData& mesh = *primitive.mesh;
            for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
                const float t = meet(origin, d, mesh.positions[mesh.indices[i]], mesh.positions[mesh.indices[i + 1]],
                                     mesh.positions[mesh.indices[i + 2]]);
                if (t < distance) {
                    distance = t;
                    nearest = node;
                }
            }
        }
    });
    return nearest;
}

std::vector<glm::vec3> NodeBox::corners(const glm::dmat4& matrix) const {
    std::vector<glm::vec3> points;
    for (int k = 0; k < 8 && !empty; ++k)
        points.emplace_back(matrix *
                            glm::dvec4(k & 1 ? high.x : low.x, k & 2 ? high.y : low.y, k & 4 ? high.z : low.z, 1));
    return points;
}

NodeBox boxOf(const engine::Registry& registry, Entity root) {
    NodeBox box;
    struct Visit {
        Entity node;
        glm::dmat4 matrix;
    };
    std::vector<Visit> open{{root, glm::dmat4(1)}};
    while (!open.empty()) {
        const Visit visit = open.back();
        open.pop_back();
        if (const auto* instance = registry.find<engine::MeshInstance>(visit.node))
            for (const engine::Primitive& primitive : instance->primitives)
                for (const glm::vec3& position : primitive.mesh->positions) {
                    const glm::vec3 p(visit.matrix * glm::dvec4(position, 1));
                    box.low = box.empty ? p : glm::min(box.low, p);
                    box.high = box.empty ? p : glm::max(box.high, p);
                    box.empty = false;
                }
        for (const Entity child : registry.get<engine::Hierarchy>(visit.node).children)
            open.push_back({child, visit.matrix * localMatrix(registry.get<engine::LocalTransform>(child))});
    }
    return box;
}

}  // namespace touchstone::sandbox
