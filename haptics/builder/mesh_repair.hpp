#pragma once
// From triangles as files bring them to surfaces that bound a volume, as far as they do.
#include <vector>

#include "haptics/builder/triangle_bvh.hpp"
#include "haptics/builder/triangle_mesh.hpp"
#include "haptics/builder/workers.hpp"

namespace touchstone {

/// What a face means for the body.
enum class FaceRole {
    Wall,    ///< outer surface of a closed shell, front outside
    Buried,  ///< of a closed shell, but inside the union of all of them: no wall of the body
    Cap,     ///< closes a small hole; nobody drew it, so nothing has to cover it
    Sheet,   ///< bounds no volume
};

struct Face {
    Triangle corners;
    FaceRole role = FaceRole::Sheet;
    bool exposed = false;  ///< a sheet outside the closed shells: the body is not closed
};

/// Lengths are in a frame scaled by the power of two that brings the bounding box's diagonal into [1, 2); not moved.
struct RepairedMesh {
    double scale = 1;             ///< mm to this frame; exact
    double diagonal = 1;          ///< of the bounding box of the triangles below
    double weld = 0;              ///< the faces are no further than this from what was drawn
    std::vector<Triangle> cover;  ///< every usable triangle as it came in
    std::vector<Face> faces;      ///< welded, oriented, without duplicates
    int holes = 0;                ///< small holes closed by caps
    bool closed() const;          ///< no hole and no sheet in the open
};

/// Welds vertices (1e-6 of the diagonal) and T-junctions (a vertex on another face's open edge), drops collapsed and
/// duplicate faces, makes every shell (faces joined across edges that two of them share) consistent, and turns it by
/// its signed volume. A shell wholly inside another keeps its sense relative to it: turned inward it is a cavity, else
/// it is buried. Two faces back to back cancel and become a sheet; so does every open shell, unless its holes are small
/// (caps of at most 1 % of its area), which are closed. Open shells that share edges are tried together, without the
/// flaps on them. Deterministic; near-linear in the triangles; about 250 bytes of memory a triangle, result included,
/// 500 if there is more than one shell. Throws std::invalid_argument with one sentence if no triangle has an area, a
/// coordinate is no number, or floats cannot hold the mesh.
RepairedMesh repairMesh(const TriangleMesh& mesh, const Heartbeat& heartbeat = {});

}  // namespace touchstone
