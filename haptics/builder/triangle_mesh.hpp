#pragma once
// A triangle mesh: the surface that a sphere tree covers.
#include <array>
#include <cstdint>
#include <vector>

#include "haptics/math/rigid.hpp"

namespace touchstone {

/// Triangles in mm, counter-clockwise seen from outside. The readers of mesh files make sure that indices are valid and
/// coordinates finite.
struct TriangleMesh {
    std::vector<Vec3> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    /// The grid on which the file rounded the coordinates, mm: a vertex may lie off its true place by half of it along
    /// each axis. 0: they are exact.
    double grid = 0;
};

}  // namespace touchstone
