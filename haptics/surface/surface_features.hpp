#pragma once
// The features of a closed part at which it can touch another part first: faces, convex edges, supported vertices.
#include <array>
#include <vector>

#include "haptics/builder/mesh_repair.hpp"

namespace touchstone {

/// Where two parts that do not overlap touch first, a vertex of one meets a face of the other, or two edges cross. Only
/// edges between faces that form an angle of less than 180° of material, and vertices with a plane that touches the
/// material around them in that point alone, can take part: at any other, a neighboring feature touches before it.
struct SurfaceFeatures {
    struct Face {
        std::array<int, 3> points;  ///< counter-clockwise seen from outside
        Vec3 normal;                ///< of unit length, outward
    };
    struct Edge {
        std::array<int, 2> points;
        std::array<int, 2> faces;  ///< those that meet here; the material lies behind both
    };
    struct Vertex {
        int point;
        int firstSpoke, spokes;  ///< range of `spokes`: the other ends of all edges here, convex or not
    };
    /// The features that were dropped, by reason.
    struct Dropped {
        int flatEdges = 0;            ///< between faces in one plane
        int concaveEdges = 0;         ///< between faces with 180° of material or more
        int buriedEdges = 0;          ///< at a face or between faces that lie inside another shell of the part
        int unsupportedVertices = 0;  ///< every plane through them cuts the material around them
        int buriedVertices = 0;       ///< at a face that lies inside another shell of the part
        int needles = 0;              ///< faces as thin as rounding: flipped into their neighbors, or covered by them
    };

    std::vector<Vec3> points;  ///< mm
    std::vector<Face> faces;
    std::vector<Edge> edges;
    std::vector<Vertex> vertices;  ///< two of them have the same point where two tips meet or shells share a tip
    std::vector<int> spokes;       ///< points
    Dropped dropped;

    Triangle triangle(int face) const {
        const auto& c = faces[face].points;
        return {points[c[0]], points[c[1]], points[c[2]]};
    }
};

/// Finds the features of the walls and caps of a body, lengths in mm. Whether an edge is convex is decided from the
/// welded coordinates in more than double precision. Pre: body.closed(); of another body the features of its closed
/// shells are found, so that a body of sheets alone has none. Deterministic; time is near-linear in the number of
/// faces. Calls the heartbeat now and then.
SurfaceFeatures surfaceFeatures(const RepairedMesh& body, const Heartbeat& heartbeat = {});

}  // namespace touchstone
