#pragma once
// Triangulation of polygons.
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/scene/mesh_data.hpp"

class GLUtesselator;

namespace touchstone::engine {

/// Triangulates polygons of any shape, including concave and self-intersecting ones.
class PolygonTessellator {
  public:
    /// Triangles are appended to `mesh`, which must outlive this.
    explicit PolygonTessellator(MeshData& mesh);

    /// Appends the triangles of a polygon with the same orientation. `corners`: indices of the mesh's positions.
    /// Positions are added where edges cross. A polygon without area gives no triangle. Returns false and appends
    /// nothing if the edges cross so often that the time would not be linear in the number of corners.
    bool add(const std::vector<std::uint32_t>& corners);

  private:
    glm::dvec3 at(std::uint32_t index) const { return mesh_.positions[index]; }
    bool crossesOften(const std::vector<std::uint32_t>& corners, const glm::dvec3& normal) const;
    void* crossing(const glm::vec3& place, void* const from[4]);

    MeshData& mesh_;
    std::unique_ptr<GLUtesselator, void (*)(GLUtesselator*)> tess_;
};

}  // namespace touchstone::engine
