#pragma once
// The surface that a sphere tree covers.
#include <array>
#include <cstdint>
#include <vector>

#include "haptics/math/rigid.hpp"

namespace touchstone {

/// Triangles in mm, counter-clockwise seen from outside. Indices are valid and coordinates finite: readers see to it.
struct TriangleMesh {
    std::vector<Vec3> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

}  // namespace touchstone
