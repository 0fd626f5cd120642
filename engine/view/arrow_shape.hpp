#pragma once
// The arrow as a solid of revolution, stretched by arrow.vert.
#include <glm/glm.hpp>
#include <vector>

namespace touchstone::engine {

inline constexpr float kArrowHeadRadius = 2.4f, kArrowHeadLength = 6;  ///< in shaft radii

struct ArrowVertex {
    glm::vec4 profile, ring;  ///< see arrow.vert
};

/// Triangles of shaft and head about the axis, counter-clockwise seen from outside.
std::vector<ArrowVertex> arrowShape();

}  // namespace touchstone::engine
