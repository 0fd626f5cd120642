#pragma once
// From points and triangles in mm to a mesh for the scene.
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "engine/scene/mesh_data.hpp"
#include "tools/parts/planar.hpp"

namespace touchstone::app {

/// Triangles that share vertices by index. Lengths in mm.
struct Solid {
    std::vector<glm::dvec3> points;
    std::vector<std::array<std::uint32_t, 3>> triangles;

    /// Adds a triangle by its corners, which may be new points.
    void add(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);
};

/// A cross-section at a height. The plane's (u, v) is (x, -z), so that counter-clockwise means the same seen from +y.
struct Section {
    double y;
    Outline outline;
};

/// The wall through sections of equal point counts, from first to last; it faces away from the axis when they rise, and
/// toward it when they fall. Rows are added until they are at most `spacing` high. Edges without length are skipped.
void addWall(Solid& solid, std::span<const Section> sections, double spacing);

/// A flat end at height y, facing up or down.
void addEnd(Solid& solid, double y, const PlanarMesh& mesh, bool up);

/// Welds equal positions, splits vertices along edges sharper than 30 degrees, and converts mm to meters. Triangles
/// without three distinct positions are dropped.
engine::MeshData finished(const Solid& solid);

}  // namespace touchstone::app
