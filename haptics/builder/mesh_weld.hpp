#pragma once
// Turns the separate triangles of a file into faces that share vertices.
#include "haptics/builder/mesh_faces.hpp"
#include "haptics/builder/triangle_mesh.hpp"

namespace touchstone {

struct WeldedMesh {
    std::vector<Vec3> vertices;
    std::vector<Corners> faces;      ///< each has three different corners, and no two are equal
    std::vector<Corners> membranes;  ///< faces with equally many copies of both orientations: they bound nothing
    std::vector<int> placeOf;        ///< vertex here by vertex of the input; -1 for one without a triangle
    std::vector<int> crumbs;         ///< input triangles that have an area but collapse at the tolerance
    double moved = 0;                ///< upper bound on the distance that the surface moved
    MeshRepairs repairs;             ///< joined, stitched, degenerate, duplicates
};

/// Distances within which vertices are joined and set into edges. Both in mm times the scale of weldMesh().
struct WeldTolerance {
    double all;   ///< everywhere
    double open;  ///< along open edges, where parts of one surface should meet; at least `all`
};

/// Joins vertices within the tolerance, and drops duplicate faces and faces without an area. Where a vertex lies on the
/// open edge of another face (a T-junction), that face is split so that both share the vertex. `box` contains all
/// corners. Lengths, including `box`, are in mm times `scale`. Deterministic.
WeldedMesh weldMesh(const TriangleMesh& mesh, double scale, const Box& box, const WeldTolerance& tolerance,
                    Pulse& pulse);

}  // namespace touchstone
