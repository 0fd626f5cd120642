#pragma once
// Triangles of round surfaces and threads with lines across the turns in equal distances, and what their edges share
// with other faces.
#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>
#include <map>
#include <vector>

#include "engine/scene/cad_parts.hpp"
#include "tools/step/step_mesh.hpp"

namespace touchstone::step {

/// Where the lines of a face lie: at whole numbers of s = start + rate · parameter. Spheres and tori, which bend along
/// their lines as well, have rows at whole numbers of rowStart + rowRate · v.
struct Pattern {
    int facets = 0;       ///< per turn; 0 for faces that are left to Open Cascade
    bool alongV = false;  ///< the parameter that runs about the axis is v, else u
    double start = 0, rate = 0;
    double rowStart = 0, rowRate = 0;  ///< 0: no rows
};

/// Whether the face is a sphere or a torus.
bool isDoublyRound(const engine::CadFace& face);

/// The patterns of cylinders, cones, spheres, tori and threads. `deviation` in mm.
std::vector<Pattern> patternsOf(const std::vector<TopoDS_Face>& faces, const std::vector<engine::CadFace>& described,
                                double deviation, bool inStep);

/// Triangulates the faces that have facets, in the shape itself, so that Open Cascade takes the points of their edges
/// for the faces beside them. Returns false if a face cannot be: then the shape has triangles of some faces only.
bool applyPatterns(const std::vector<TopoDS_Face>& faces, const std::vector<Pattern>& patterns, double deviation);

}  // namespace touchstone::step
