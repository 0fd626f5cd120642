#pragma once
// From the corners that files hold to faces that share vertices.
#include "haptics/builder/mesh_faces.hpp"
#include "haptics/builder/triangle_mesh.hpp"

namespace touchstone {

struct WeldedMesh {
    std::vector<Vec3> vertices;
    std::vector<Corners> faces;      ///< of three different corners, no two the same
    std::vector<Corners> membranes;  ///< drawn equally often from both sides: they bound nothing
    std::vector<int> crumbs;         ///< triangles of the mesh with an area but smaller than the tolerance
    double moved = 0;                ///< the surface moved no further than this
};

/// Joins vertices within the tolerance, drops what has no area then, and duplicates. Where a vertex lies on the open
/// edge of another face (a T-junction), that face is split, so that the two fit. Lengths, `box` (around all corners)
/// and `tolerance` among them, are in mm times `scale`. Deterministic.
WeldedMesh weldMesh(const TriangleMesh& mesh, double scale, const Box& box, double tolerance, Pulse& pulse);

}  // namespace touchstone
