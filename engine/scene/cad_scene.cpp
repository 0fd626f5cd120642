#include "engine/scene/cad_scene.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <tuple>

#include "engine/scene/transforms.hpp"

namespace touchstone::engine {
namespace {

/// A mesh about a round point near its middle, since single precision keeps fewer digits far from the origin.
struct CenteredMesh {
    std::shared_ptr<const MeshData> mesh;
    glm::dvec3 center{0};
};

CenteredMesh meshOf(const CadShape& shape, double crease) {
    glm::dvec3 low(HUGE_VAL), high(-HUGE_VAL);
    for (const glm::dvec3& vertex : shape.vertices) {
        low = glm::min(low, vertex);
        high = glm::max(high, vertex);
    }
    CenteredMesh out;
    const double size = glm::length(high - low);
    if (const double round = std::pow(10.0, std::floor(std::log10(size))); glm::length(low + high) / 2 > size)
        out.center = round * glm::round((low + high) / 2.0 / round);
    MeshData mesh;
    for (const glm::dvec3& vertex : shape.vertices) mesh.positions.emplace_back(vertex - out.center);
    for (const auto& triangle : shape.triangles)
        mesh.indices.insert(mesh.indices.end(), triangle.begin(), triangle.end());
    mesh.normals = smoothNormals(mesh);
    out.mesh = std::make_shared<const MeshData>(splitAtCreases(mesh, crease));
    return out;
}

}  // namespace

Scene sceneOf(const CadAssembly& assembly, std::span<const std::uint32_t> parts, const Material& material,
              double crease, const glm::dmat4& toScene) {
    Scene scene;
    scene.name = assembly.name;
    std::map<std::uint32_t, CenteredMesh> meshes;
    std::map<std::tuple<float, float, float>, int> colors;
    int plain = -1;
    const auto materialOf = [&](const CadPart& part) {
        if (!part.color) return plain < 0 ? plain = addMaterial(scene, material) : plain;
        const glm::vec3& c = *part.color;
        const auto [known, isNew] = colors.emplace(std::tuple(c.r, c.g, c.b), 0);
        if (isNew)
            known->second = addMaterial(
                scene,
                {.name = "color " + std::to_string(colors.size()), .baseColor = {c.r, c.g, c.b, 1}, .metallic = 0.3f});
        return known->second;
    };
    for (const std::uint32_t index : parts) {
        const CadPart& part = assembly.parts[index];
        const CadShape& shape = assembly.shapes[part.shape];
        if (shape.triangles.empty()) continue;
        const auto [mesh, isNew] = meshes.try_emplace(part.shape);
        if (isNew) mesh->second = meshOf(shape, crease);
        const glm::dmat4 place = glm::translate(toScene * part.placement, mesh->second.center);
        addMesh(scene, addNode(scene, part.name, {}, localTransform(place)), mesh->second.mesh, materialOf(part));
    }
    updateWorldTransforms(scene);
    return scene;
}

}  // namespace touchstone::engine
