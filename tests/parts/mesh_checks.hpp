#pragma once
// Properties that a solid must have, computed from its stored positions alone.
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <vector>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::app {

inline glm::dvec3 corner(const engine::MeshData& mesh, std::size_t i) {
    return glm::dvec3(mesh.positions[mesh.indices[i]]) * 1000.0;  // mm
}

/// Every directed edge between positions occurs once in each direction.
inline bool isClosed(const engine::MeshData& mesh) {
    using Point = std::tuple<float, float, float>;
    const auto point = [&](std::size_t i) {
        const glm::vec3 p = mesh.positions[mesh.indices[i]];
        return Point{p.x, p.y, p.z};
    };
    std::map<std::pair<Point, Point>, int> edges;
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) ++edges[{point(i), point(i % 3 == 2 ? i - 2 : i + 1)}];
    return std::all_of(edges.begin(), edges.end(), [&](const auto& edge) {
        const auto back = edges.find({edge.first.second, edge.first.first});
        return edge.second == 1 && back != edges.end() && back->second == 1;
    });
}

/// mm³, positive when the triangles face outward.
inline double volume(const engine::MeshData& mesh) {
    double sixfold = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        sixfold += glm::dot(corner(mesh, i), glm::cross(corner(mesh, i + 1), corner(mesh, i + 2)));
    return sixfold / 6;
}

/// The smallest angle of any triangle, rad.
inline double leastAngle(const engine::MeshData& mesh) {
    double least = 10;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        for (std::size_t k = 0; k < 3; ++k) {
            const glm::dvec3 a = corner(mesh, i + k);
            const glm::dvec3 u = corner(mesh, i + (k + 1) % 3) - a, v = corner(mesh, i + (k + 2) % 3) - a;
            least = std::min(least, std::atan2(glm::length(glm::cross(u, v)), glm::dot(u, v)));
        }
    return least;
}

inline double longestEdge(const engine::MeshData& mesh) {
    double longest = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); ++i)
        longest = std::max(longest, glm::distance(corner(mesh, i), corner(mesh, i % 3 == 2 ? i - 2 : i + 1)));
    return longest;
}

/// Whether p, mm, is inside a closed mesh: from inside the triangles fill the whole solid angle, from outside none of
/// it.
inline bool isInside(const engine::MeshData& mesh, const glm::dvec3& p) {
    double halfAngles = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const glm::dvec3 a = corner(mesh, i) - p, b = corner(mesh, i + 1) - p, c = corner(mesh, i + 2) - p;
        const double A = glm::length(a), B = glm::length(b), C = glm::length(c);
        halfAngles += std::atan2(glm::dot(a, glm::cross(b, c)),
                                 A * B * C + glm::dot(a, b) * C + glm::dot(b, c) * A + glm::dot(c, a) * B);
    }
    return halfAngles > std::acos(-1.0);  // of 2 pi
}

/// Distance from p to a segment, mm.
inline double distanceToSegment(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b) {
    const double t = std::clamp(glm::dot(p - a, b - a) / glm::dot(b - a, b - a), 0.0, 1.0);
    return glm::distance(p, a + t * (b - a));
}

/// Distance from p to the surface, mm.
inline double distanceTo(const engine::MeshData& mesh, const glm::dvec3& p) {
    double least = 1e300;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const glm::dvec3 a = corner(mesh, i), b = corner(mesh, i + 1), c = corner(mesh, i + 2);
        const glm::dvec3 n = glm::normalize(glm::cross(b - a, c - a));
        const double height = glm::dot(p - a, n);
        if (std::abs(height) >= least) continue;
        const glm::dvec3 foot = p - height * n;
        const bool within = glm::dot(glm::cross(b - a, foot - a), n) >= 0 &&
                            glm::dot(glm::cross(c - b, foot - b), n) >= 0 &&
                            glm::dot(glm::cross(a - c, foot - c), n) >= 0;
        least =
            within
                ? std::abs(height)
                : std::min({least, distanceToSegment(p, a, b), distanceToSegment(p, b, c), distanceToSegment(p, c, a)});
    }
    return least;
}

}  // namespace touchstone::app
