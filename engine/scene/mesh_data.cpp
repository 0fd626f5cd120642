#include "engine/scene/mesh_data.hpp"

namespace touchstone::engine {

std::vector<glm::vec3> smoothNormals(const MeshData& mesh) {
    // In doubles, so that the cross product of tiny or huge triangles keeps its direction.
    std::vector<glm::dvec3> sums(mesh.positions.size(), glm::dvec3(0));
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        const auto a = mesh.indices[i], b = mesh.indices[i + 1], c = mesh.indices[i + 2];
        const glm::dvec3 p = mesh.positions[a];
        const glm::dvec3 doubleArea = glm::cross(glm::dvec3(mesh.positions[b]) - p, glm::dvec3(mesh.positions[c]) - p);
        sums[a] += doubleArea;
        sums[b] += doubleArea;
        sums[c] += doubleArea;
    }
    std::vector<glm::vec3> normals(sums.size());
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const double length = glm::length(sums[i]);
        normals[i] = length > 0 ? glm::vec3(sums[i] / length) : glm::vec3(0, 0, 1);
    }
    return normals;
}

}  // namespace touchstone::engine
