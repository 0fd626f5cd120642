#pragma once
// Round wire bent along a line.
#include <span>
#include <vector>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::app {

/// Wire of a radius along a line of points, with round ends; or, `closed`, a ring whose last point joins the first. The
/// line is to bend more gently than the wire is thick. Lengths in mm, the mesh in metres and watertight.
/// Throws std::invalid_argument with one sentence when the line has too few points or a bend is too sharp.
engine::MeshData wire(std::span<const glm::dvec3> line, double radius, bool closed, double spacing);

/// Points of an arc about `centre` from angle to angle (rad, from u towards v), both ends included. Pre: u and v are
/// unit vectors square to each other.
std::vector<glm::dvec3> arc(const glm::dvec3& centre, const glm::dvec3& u, const glm::dvec3& v, double radius,
                            double from, double to, double spacing);

}  // namespace touchstone::app
