#pragma once
// What a repair changed, and why a mesh is not closed, in words.
#include <string>

#include "haptics/builder/mesh_repair.hpp"

namespace touchstone {

/// The unit in which a file has its coordinates: places are also given in it if it is not mm.
struct PlaceUnit {
    const char* name = "mm";
    double mm = 1;
};

/// Why a mesh is not closed: "3 holes (40 open edges), the widest 8.1 mm across at (0.0, 3.1, 12.0) mm, and 1 edge of
/// more than two faces".
std::string words(const MeshDefects& defects, const PlaceUnit& unit = {});

/// What a repair changed: "12 corners joined, 340 corners set into edges (by up to 0.0017 mm), 100 triangles without
/// area dropped, 1 hole closed: 4.2 mm across at (0.0, 3.1, 12.0) mm"; empty if nothing.
std::string words(const RepairedMesh& body, const PlaceUnit& unit = {});
/// Whether a repair changed the surface that is touched: moved corners, turned over triangles, closed holes or left out
/// loose sheets. Dropping copies, triangles without area or those inside the part does not.
bool changedSurface(const RepairedMesh& body);

}  // namespace touchstone
