#pragma once
// Triangles of polygons.
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/scene/mesh_data.hpp"

class GLUtesselator;

namespace touchstone::engine {

/// Triangulates polygons of any shape, concave ones and ones that cross themselves included.
class PolygonTessellator {
  public:
    /// Triangles are appended to `mesh`, which must outlive this.
    explicit PolygonTessellator(MeshData& mesh);

    /// Appends the triangles of a polygon between the mesh's positions, wound as it is; where its edges cross,
    /// positions are added. A polygon without area gives none.
    /// False, and none are appended, if its edges cross so often that the time would not be linear in the corners.
    bool add(const std::vector<std::uint32_t>& corners);

  private:
    glm::dvec3 at(std::uint32_t index) const { return mesh_.positions[index]; }
    bool crossesOften(const std::vector<std::uint32_t>& corners, const glm::dvec3& normal) const;
    void* crossing(const glm::vec3& place, void* const from[4]);

    MeshData& mesh_;
    std::unique_ptr<GLUtesselator, void (*)(GLUtesselator*)> tess_;
};

}  // namespace touchstone::engine
