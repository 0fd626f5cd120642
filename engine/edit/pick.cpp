#include "engine/edit/pick.hpp"

#include <limits>

#include "engine/scene/transforms.hpp"

namespace touchstone::engine {
namespace {

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

Entity pickNode(const Registry& registry, const Placement& placement, const Ray& ray) {
    Entity nearest;
    float distance = std::numeric_limits<float>::infinity();
    registry.each<MeshInstance>([&](Entity node, const MeshInstance& instance) {
        if (!isVisible(registry, node)) return;
        // In the mesh's frame, with the direction unscaled: distances along the ray stay those of the scene.
        const glm::dmat4 inverse = glm::inverse(placement(node));
        const glm::vec3 origin(inverse * glm::dvec4(ray.origin, 1)), d(inverse * glm::dvec4(ray.direction, 0));
        for (const Primitive& primitive : instance.primitives) {
            const MeshData& mesh = *primitive.mesh;
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

NodeBox boxOf(const Registry& registry, Entity root) {
    NodeBox box;
    struct Visit {
        Entity node;
        glm::dmat4 matrix;
    };
    std::vector<Visit> open{{root, glm::dmat4(1)}};
    while (!open.empty()) {
        const Visit visit = open.back();
        open.pop_back();
        if (const auto* instance = registry.find<MeshInstance>(visit.node))
            for (const Primitive& primitive : instance->primitives)
                for (const glm::vec3& position : primitive.mesh->positions) {
                    const glm::vec3 p(visit.matrix * glm::dvec4(position, 1));
                    box.low = box.empty ? p : glm::min(box.low, p);
                    box.high = box.empty ? p : glm::max(box.high, p);
                    box.empty = false;
                }
        for (const Entity child : registry.get<Hierarchy>(visit.node).children)
            open.push_back({child, visit.matrix * localMatrix(registry.get<LocalTransform>(child))});
    }
    return box;
}

}  // namespace touchstone::engine
