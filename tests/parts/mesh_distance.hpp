#pragma once
// Distances and intersections of the triangles of two parts, by every pair of vertex and triangle and of edges.
#include <algorithm>
#include <vector>

#include "engine/scene/mesh_data.hpp"
#include "haptics/reference/contact_surface.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::app {

/// The triangles, mm, of a mesh that is turned about the y axis and lifted along it.
inline std::vector<Triangle> trianglesOf(const engine::MeshData& mesh, double y = 0, double angle = 0) {
    const Eigen::AngleAxisd turn(angle, Vec3::UnitY());
    std::vector<Triangle> triangles(mesh.indices.size() / 3);
    for (std::size_t i = 0; i < mesh.indices.size(); ++i)
        triangles[i / 3][i % 3] = turn * sandbox::toMm(mesh.positions[mesh.indices[i]]) + Vec3(0, y, 0);
    return triangles;
}

inline bool intersect(const Triangle& a, const Triangle& b) {
    for (int k = 0; k < 3; ++k)
        if (pierces(a[k], a[(k + 1) % 3], b) || pierces(b[k], b[(k + 1) % 3], a)) return true;
    return false;
}

inline double distanceOf(const Triangle& a, const Triangle& b) {
    if (intersect(a, b)) return 0;
    double least = 1e300;
    for (int i = 0; i < 3; ++i) {
        least = std::min(least, (closestPoint(a[i], b, false) - a[i]).norm());
        least = std::min(least, (closestPoint(b[i], a, false) - b[i]).norm());
        for (int j = 0; j < 3; ++j) {
            const Vec3 &p = a[i], &q = a[(i + 1) % 3], &u = b[j], &v = b[(j + 1) % 3];
            double s, t;
            if (crossing(p, q, u, v, s, t) && s > 0 && s < 1 && t > 0 && t < 1)
                least = std::min(least, (p + s * (q - p) - u - t * (v - u)).norm());
        }
    }
    return least;
}

/// The least distance of the triangles if it is less than `bound`, else `bound`; 0 if some intersect.
inline double distanceOf(const std::vector<Triangle>& some, const TriangleBvh& tree,
                         const std::vector<Triangle>& others, double bound) {
    for (const Triangle& t : some) {
        Box box;
        for (const Vec3& p : t) box.add(p);
        box.lo.array() -= bound, box.hi.array() += bound;
        tree.overlapping(box, [&](int other) { bound = std::min(bound, distanceOf(t, others[other])); });
    }
    return bound;
}

/// Number of pairs of triangles without a common corner that intersect.
inline int selfIntersections(const engine::MeshData& mesh) {
    const std::vector<Triangle> triangles = trianglesOf(mesh);
    const TriangleBvh tree(triangles);
    int count = 0;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        Box box;
        for (const Vec3& p : triangles[i]) box.add(p);
        tree.overlapping(box, [&](int other) {
            const Triangle& t = triangles[other];
            const bool joined = std::ranges::any_of(t, [&](const Vec3& p) {
                return std::ranges::any_of(triangles[i], [&](const Vec3& q) { return p == q; });
            });
            count += other > static_cast<int>(i) && !joined && intersect(triangles[i], t);
        });
    }
    return count;
}

}  // namespace touchstone::app
