#pragma once
// Geometry and materials as plain data, independent of the GPU.
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace touchstone::engine {

/// Indexed triangles in meters, counter-clockwise seen from outside. `normals` has one entry per position; `texcoords`
/// and `colors` likewise, or are empty.
struct MeshData {
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;
    std::vector<glm::vec2> texcoords;
    std::vector<std::uint32_t> indices;
    std::vector<glm::vec4> colors = {};  ///< linear; multiply the material's base color
    bool flat = false;  ///< drawn with the normals of its triangles, as glTF wants for a mesh without normals
};

/// 8-bit RGBA, row by row from the top.
struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgba;
};

/// What the alpha of the base color does: nothing, cut holes where it is below a cutoff, or make see-through.
enum class AlphaMode { Opaque, Mask, Blend };

/// The metallic-roughness material of glTF: linear factors, multiplied by textures. Textures are indices into
/// Scene::images, -1 for none, and share one set of texture coordinates.
struct Material {
    std::string name;
    glm::vec4 baseColor{1};
    float metallic = 0, roughness = 0.6f;
    int texture = -1;                   ///< base color, sRGB
    int metallicRoughnessTexture = -1;  ///< roughness in green, metalness in blue
    int normalTexture = -1;             ///< tangent space
    int emissiveTexture = -1;           ///< sRGB
    float normalScale = 1;
    glm::vec3 emissive{0};
    AlphaMode alphaMode = AlphaMode::Opaque;
    float alphaCutoff = 0.5f;  ///< of AlphaMode::Mask

    std::array<int, 4> textures() const { return {texture, metallicRoughnessTexture, normalTexture, emissiveTexture}; }
    friend bool operator==(const Material&, const Material&) = default;
};

/// The step to which a file rounded its coordinates, in their unit: a power of ten, or the step of a normalized
/// integer. In a text with a fixed number of digits it is that of the largest coordinates. If no step can be found, it
/// is the spacing of floats at these coordinates, and 0 if all coordinates are 0.
double gridOf(const MeshData& mesh);

/// Smooth unit normals: at each position the area-weighted mean of the triangle normals; +z if that is zero.
std::vector<glm::vec3> smoothNormals(const MeshData& mesh);

/// The same triangles with vertices doubled along creases, and normals that are smooth only between them: a crease is
/// an edge whose faces turn by more than `angle`, rad, at most pi. Vertices without a triangle are dropped.
MeshData splitAtCreases(const MeshData& mesh, double angle);

}  // namespace touchstone::engine
