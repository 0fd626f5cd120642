#pragma once
// Triangles of cylinders and cones with lines along the axis in equal distances, and what their edges share with other
// faces.
#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>
#include <map>
#include <vector>

#include "engine/scene/cad_parts.hpp"
#include "tools/step/step_mesh.hpp"

namespace touchstone::step {

/// Facets per turn of each face; 0 for faces that are left to Open Cascade. `deviation` in mm.
std::vector<int> facetsOf(const std::vector<TopoDS_Face>& faces, const std::vector<engine::CadFace>& described,
                          double deviation, bool inStep);

/// Triangulates the faces that have facets, in the shape itself, so that Open Cascade takes the points of their edges
/// for the faces beside them. Returns false if a face cannot be: then the shape has triangles of some faces only.
bool applyPatterns(const std::vector<TopoDS_Face>& faces, const std::vector<int>& facets, double deviation);

}  // namespace touchstone::step
