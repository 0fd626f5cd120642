#include "haptics/sandbox/scene/baked_mesh.hpp"

#include <vector>

#include "engine/scene/rigid_bodies.hpp"
#include "engine/scene/transforms.hpp"
#include "haptics/sandbox/scene/role.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {
namespace {

using engine::Entity;
using engine::Scene;

/// The largest factor by which a matrix lengthens a vector along an axis.
double stretchOf(const glm::dmat4& matrix) {
    const glm::dmat3 linear(matrix);
    return std::max({glm::length(linear[0]), glm::length(linear[1]), glm::length(linear[2])});
}

void appendMesh(const engine::MeshData& mesh, const glm::dmat4& matrix, TriangleMesh& surface) {
    const auto base = static_cast<std::uint32_t>(surface.vertices.size());
    for (const glm::vec3& position : mesh.positions)
        surface.vertices.push_back(toMm(glm::dvec3(matrix * glm::dvec4(position, 1))));
    surface.grid = std::max(surface.grid, stretchOf(matrix) * kMmPerMeter * gridOf(mesh));
    const bool mirrored = glm::determinant(glm::dmat3(matrix)) < 0;
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        const std::uint32_t a = base + mesh.indices[i], b = base + mesh.indices[i + 1], c = base + mesh.indices[i + 2];
        // A mirrored triangle turns over, to stay counter-clockwise seen from outside.
        surface.triangles.push_back({a, mirrored ? c : b, mirrored ? b : c});
    }
}

void appendInstance(const engine::MeshInstance& instance, const glm::dmat4& matrix, TriangleMesh& surface) {
    for (const engine::Primitive& primitive : instance.primitives) appendMesh(*primitive.mesh, matrix, surface);
}

/// Calls f(node, matrix) for `root`, whose matrix is given, and for everything below it that belongs to it: nodes with
/// a role, and what is below them, are left out.
template <class F>
void eachPart(const Scene& scene, Entity root, const glm::dmat4& matrix, F&& f) {
    struct Visit {
        Entity node;
        glm::dmat4 matrix;
    };
    std::vector<Visit> open{{root, matrix}};
    while (!open.empty()) {
        const Visit visit = open.back();
        open.pop_back();
        f(visit.node, visit.matrix);
        const auto& children = scene.registry.get<engine::Hierarchy>(visit.node).children;
        for (auto child = children.rbegin(); child != children.rend(); ++child)  // first child on top
            if (!scene.registry.has<Role>(*child))
                open.push_back(
                    {*child, visit.matrix * localMatrix(scene.registry.get<engine::LocalTransform>(*child))});
    }
}

/// Calls f(instance, matrix) for the meshes of a body, in its rigid frame: its colliders if it has any.
template <class F>
void eachInstance(const Scene& scene, Entity roleNode, F&& f) {
    const glm::dmat4 world = worldMatrix(scene.registry, roleNode);
    const glm::dmat4 frame = glm::inverse(engine::rigidMatrix(engine::rigidPart(world)));
    const auto eachDrawn = [&](Entity root, const glm::dmat4& matrix) {
        eachPart(scene, root, matrix, [&](Entity part, const glm::dmat4& partMatrix) {
            if (const auto* instance = scene.registry.find<engine::MeshInstance>(part)) f(*instance, partMatrix);
        });
    };
    bool colliders = false;
    eachPart(scene, roleNode, frame * world, [&](Entity node, const glm::dmat4& matrix) {
        const engine::ColliderGeometry* geometry = scene.registry.find<engine::ColliderGeometry>(node);
        if (!geometry) return;
        colliders = true;
        // The meshes of another node are placed as if it were this node: its own transform does not count.
        if (geometry->mesh >= 0)
            f(scene.meshes[geometry->mesh], matrix);
        else
            eachDrawn(geometry->node >= 0 ? scene.nodes[geometry->node] : node, matrix);
    });
    if (!colliders) eachDrawn(roleNode, frame * world);
}

}  // namespace

TriangleMesh bakedTriangles(const Scene& scene, Entity roleNode) {
    TriangleMesh surface;
    eachInstance(scene, roleNode, [&](const engine::MeshInstance& instance, const glm::dmat4& matrix) {
        appendInstance(instance, matrix, surface);
    });
    return surface;
}

double singleRounding(const Scene& scene, Entity roleNode) {
    double largest = 0;
    eachInstance(scene, roleNode, [&](const engine::MeshInstance& instance, const glm::dmat4& matrix) {
        const double stretch = stretchOf(matrix);
        for (const engine::Primitive& primitive : instance.primitives)
            for (const glm::vec3& p : primitive.mesh->positions)
                for (int k = 0; k < 3; ++k) largest = std::max(largest, stretch * double(std::abs(p[k])));
    });
    return kMmPerMeter * 0x1p-24 * largest;
}

TriangleMesh bakedTriangles(const Scene& scene) {
    TriangleMesh all;
    for (const Entity node : scene.nodes)
        if (const auto* instance = node ? scene.registry.find<engine::MeshInstance>(node) : nullptr)
            appendInstance(*instance, worldMatrix(scene.registry, node), all);
    return all;
}

TriangleMesh toTriangles(const engine::MeshFile& file, double mmPerUnit) {
    const engine::MeshData& mesh = file.mesh;
    TriangleMesh surface;
    surface.grid = mmPerUnit * gridOf(mesh);
    for (const glm::dvec3 p : mesh.positions) {
        const glm::dvec3 place = p + file.origin;
        surface.vertices.push_back(mmPerUnit * Vec3(place.x, place.y, place.z));
    }
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3)
        surface.triangles.push_back({mesh.indices[i], mesh.indices[i + 1], mesh.indices[i + 2]});
    return surface;
}

}  // namespace touchstone::sandbox
