#pragma once
// Round wire bent along a line.
#include <span>
#include <vector>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::app {

/// Wire of a radius along a line of points, with round ends; or, `closed`, a ring whose last point joins the first. The
/// line's bends must be gentler than the wire is thick. Lengths in mm; the mesh is in meters and watertight.
/// Throws std::invalid_argument with one sentence when the line has too few points or a bend is too sharp.
engine::MeshData wire(std::span<const glm::dvec3> line, double radius, bool closed, double spacing);

/// Points of an arc about `center` from angle to angle (rad, from u toward v), both ends included. Pre: u and v are
/// orthogonal unit vectors.
std::vector<glm::dvec3> arc(const glm::dvec3& center, const glm::dvec3& u, const glm::dvec3& v, double radius,
                            double from, double to, double spacing);

}  // namespace touchstone::app
