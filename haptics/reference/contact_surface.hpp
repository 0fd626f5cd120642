#pragma once
// A triangle mesh with the features that make contacts: vertices, edges and faces, and how they are connected.
#include <vector>

#include "haptics/builder/triangle_bvh.hpp"
#include "haptics/builder/triangle_mesh.hpp"

namespace touchstone {

/// Vertices with equal positions are merged, and faces without area are removed.
struct ContactSurface {
    struct Face {
        std::array<int, 3> vertices, edges;  ///< edge k joins vertices k and k + 1
    };
    struct Edge {
        std::array<int, 2> vertices;
        std::vector<int> wings;  ///< the third vertices of its faces
    };
    std::vector<Vec3> vertices;
    std::vector<Face> faces;
    std::vector<Edge> edges;
    std::vector<std::vector<int>> neighbors;  ///< of each vertex: the vertices at the other ends of its edges

    Triangle triangle(int face) const;
    Vec3 normal(int face) const;  ///< of unit length, outward
    Box box(int face) const;
};

/// Throws std::invalid_argument with one sentence if no triangle has an area.
ContactSurface makeContactSurface(const TriangleMesh& mesh);

/// A vertex, edge or face of a surface.
struct Feature {
    enum class Kind : std::uint8_t { Vertex, Edge, Face };
    Kind kind;
    int index;
};

/// The point of a face nearest to p, and the feature that it lies on.
Vec3 closestPoint(const ContactSurface& surface, int face, const Vec3& p, Feature& feature);

/// Whether the surface around the point `at` of the feature lies behind the plane through `at` with this outward
/// normal. It is true for a contact that can carry load, and false if another part of the surface extends further.
bool standsOut(const ContactSurface& surface, const Feature& feature, const Vec3& at, const Vec3& normal);

/// The nearest points a0 + s (a1 - a0) and b0 + t (b1 - b0) of two lines; false if they are parallel.
bool crossing(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1, double& s, double& t);

/// Whether the segment intersects the triangle.
bool pierces(const Vec3& a, const Vec3& b, const Triangle& triangle);

}  // namespace touchstone
