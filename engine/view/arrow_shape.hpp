#pragma once
// The solid of revolution that arrow.vert stretches.
#include <glm/glm.hpp>
#include <vector>

namespace touchstone::engine {

inline constexpr float kArrowHeadRadius = 2.4f, kArrowHeadLength = 6;  ///< in shaft radii

struct ArrowVertex {
    glm::vec4 profile, ring;  ///< see arrow.vert
};

/// Triangles of a shaft with head about the axis, outside counter-clockwise.
std::vector<ArrowVertex> arrowShape();

}  // namespace touchstone::engine
