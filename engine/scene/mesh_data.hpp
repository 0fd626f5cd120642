#pragma once
// Geometry and looks as plain data, before any GPU knows of them.
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace touchstone::engine {

/// Indexed triangles in metres, counter-clockwise seen from outside. normals has one entry a position; texcoords
/// likewise or none.
struct MeshData {
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;
    std::vector<glm::vec2> texcoords;
    std::vector<std::uint32_t> indices;
};

/// 8-bit RGBA, row by row from the top.
struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgba;
};

/// The metal-rough factors of glTF.
struct Material {
    std::string name;
    glm::vec4 baseColor{1};
    float metallic = 0, roughness = 0.6f;
    int texture = -1;  ///< base-colour texture: index into Scene::images, -1 for none
};

/// Smooth unit normals: at each position the mean of its triangles' normals weighted by area; +z where that is zero.
std::vector<glm::vec3> smoothNormals(const MeshData& mesh);

}  // namespace touchstone::engine
