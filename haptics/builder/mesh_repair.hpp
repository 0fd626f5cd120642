#pragma once
// Repairs the triangles of a file into surfaces that bound a volume, where that is possible.
#include <vector>

#include "haptics/builder/triangle_bvh.hpp"
#include "haptics/builder/triangle_mesh.hpp"
#include "haptics/builder/workers.hpp"

namespace touchstone {

/// The role of a face in the body.
enum class FaceRole {
    Wall,    ///< outer surface of a closed shell, with its front outside
    Buried,  ///< part of a closed shell, but inside the union of all shells, so it is no wall of the body
    Cap,     ///< closes a small hole by guess; it is not in the input, so the leaves need not cover it
    Sheet,   ///< bounds no volume
};

struct Face {
    Triangle corners;
    FaceRole role = FaceRole::Sheet;
    bool exposed = false;  ///< a sheet outside the closed shells: the body is not closed
};

/// What a repair changed.
struct MeshRepairs {
    int joined = 0;      ///< vertices moved onto another one
    int stitched = 0;    ///< vertices set into an edge of another triangle
    int degenerate = 0;  ///< triangles without an area, or without one at the tolerance
    int duplicates = 0;  ///< copies of another triangle
    int turned = 0;      ///< triangles turned over, so that all have their front outside
    int inner = 0;       ///< triangles inside the body: inner walls and buried shells
    bool operator==(const MeshRepairs&) const = default;
};

/// A hole that was closed, or a loose sheet that was left out. In mm.
struct MeshPatch {
    Vec3 place = Vec3::Zero();  ///< middle of its box
    double across = 0;          ///< diagonal of its box
    int triangles = 0;
};

/// Lengths are in a frame with the mesh's origin, scaled by the power of two that brings the diagonal of the bounding
/// box into [1, 2).
struct RepairedMesh {
    double scale = 1;             ///< length in this frame per mm; a power of two, so scaling is exact
    double diagonal = 1;          ///< of the bounding box of the triangles below
    double weld = 0;              ///< largest distance of the faces from the triangles of the input
    double thin = 0;              ///< altitude up to which the direction of a long face is rounding of the input
    std::vector<Triangle> cover;  ///< every usable triangle of the input that is not loose, as it was, and caps of
                                  ///< `closedHoles`
    std::vector<Face> faces;      ///< welded, oriented, without duplicates
    std::vector<Vec3> vertices;   ///< welded
    std::vector<std::array<int, 3>> walls;   ///< the walls and caps again, as vertices
    std::vector<std::array<int, 3>> buried;  ///< the buried faces again, as vertices
    int holes = 0;                           ///< number of small holes that were closed by guess
    int insideOut = 0;                       ///< number of shells that cross themselves and are inside out in part
    MeshRepairs repairs;
    std::vector<MeshPatch> closedHoles;  ///< holes that a flat or smooth cap closes: its faces are walls
    std::vector<MeshPatch> loose;        ///< sheets that enclose nothing, which were left out
    bool closed() const;                 ///< the body has no hole and no exposed sheet
};

/// Why a body is not closed.
struct MeshDefects {
    int holes = 0;         ///< connected groups of open edges; a sheet has one around it
    MeshPatch largest;     ///< of the holes; its triangles are not counted
    int openEdges = 0;     ///< edges of one face
    int crowdedEdges = 0;  ///< edges of more than two faces
    int insideOut = 0;     ///< shells that cross themselves and are inside out in part
};
/// Counts the defects among the walls and exposed sheets of a body, before small holes were closed.
MeshDefects defectsOf(const RepairedMesh& body);

/// Repairs a mesh:
/// - It welds vertices (within 1e-6 of the diagonal) and T-junctions (a vertex on the open edge of another face), and
///   drops collapsed and duplicate faces. Along open edges the tolerance is the gap that rounding to the mesh's grid
///   can leave, 1e-5 to 2.5e-3 of the diagonal.
/// - It orients every shell (faces joined at edges that exactly two of them share) consistently, and outward by its
///   signed volume. A shell wholly inside another one keeps its orientation relative to it: if opposed, it is a cavity;
///   otherwise it is buried.
/// - It closes a hole by one cap that crosses nothing, if the cap continues the surface around it (flat: up to a
/// quarter
///   of the area of the closed shell; smooth: up to 1/20) or fills a flat opening (up to a tenth; several openings: up
///   to 1/100 together).
/// - Nearly flat sheets outside the closed shells, of at most 5 % of the area of these together, or 1 % if they hang on
///   them, are left out: the result is that of a mesh without them.
/// - Two faces back to back cancel and become a sheet. An open shell also becomes a sheet, unless its holes are small
///   (caps of at most 1 % of its area): those are closed by guess. Open shells that share edges are tried together,
///   without the flaps on them. A shell that crosses itself and is inside out in part also becomes a sheet, since no
///   side of that part is known to be the outer one.
/// Deterministic. Time is near-linear in the number of triangles. Memory is about 250 bytes per triangle, including the
/// result, and 500 if there is more than one shell. Throws std::invalid_argument with one sentence if no triangle has
/// an area, if a coordinate is not finite, or if single precision cannot represent the mesh.
RepairedMesh repairMesh(const TriangleMesh& mesh, const Heartbeat& heartbeat = {});

}  // namespace touchstone
