#pragma once
// Exact faces of solids as plain data.
#include <BRepAdaptor_Surface.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>
#include <gp_Pnt.hxx>
#include <vector>

#include "engine/scene/cad_parts.hpp"

namespace touchstone::step {

/// In meters, of lengths in Open Cascade's millimeters.
glm::dvec3 meters(const gp_XYZ& point);

engine::CadFace describe(const TopoDS_Face& face);

/// Distance of a point from the exact surface near the surface's point at (u, v), mm.
double distanceToSurface(const BRepAdaptor_Surface& surface, const gp_Pnt& point, double u, double v);

constexpr double kLeastArea = 1e-15;  ///< m²: a square of 30 nm; smaller faces are ignored

/// The solids of a shape in one compound, each with its normals outward. If there is none, null, and `problem` has a
/// clause that completes "the part ...".
TopoDS_Shape solidsOf(const TopoDS_Shape& shape, std::string& problem);

/// All faces of the solids, in the order in which they are described and meshed.
std::vector<TopoDS_Face> facesOf(const TopoDS_Shape& solids);

}  // namespace touchstone::step
