#pragma once
// Closes the hole of a shell by the one flat or smooth cap that completes its surface.
#include <optional>

#include "haptics/builder/mesh_faces.hpp"

namespace touchstone {

/// An edge of a hole, as the cap runs along it.
struct RimEdge {
    int from, to;
    Vec3 beside;  ///< unit normal of the face on the other side; 0 if it has no area
};
using RimLoop = std::vector<RimEdge>;

/// Splits the edges of holes into closed loops that pass each vertex once. Edges that are part of none are left out.
std::vector<RimLoop> rimLoops(std::vector<RimEdge> edges);

/// Joins the loops that bound one flat hole: an outer one, and those around the islands in it.
std::vector<std::vector<RimLoop>> flatHoles(const std::vector<Vec3>& vertices, std::vector<RimLoop> loops);

struct MeshCap {
    std::vector<Corners> faces;
    double area = 0;
    double continued = 0;  ///< share of the rim where the cap continues the face beside it with a bend of at most 30°
    bool flat = false;
    bool level = false;  ///< each of its faces lies in the plane of a face beside it
};

/// A triangulation of the loops of one hole: without overlap if it is flat, otherwise the smoothest. Nothing if there
/// is no such triangulation, or the rim has more than 400 edges (100 if it is not flat).
std::optional<MeshCap> capOf(const std::vector<Vec3>& vertices, const std::vector<RimLoop>& hole);

}  // namespace touchstone
