#include "tools/parts/solid.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace touchstone::app {
namespace {

glm::dvec3 inSpace(glm::dvec2 p, double y) { return {p.x, y, -p.y}; }

/// Angle of a triangle at its corner `at`, the weight of its normal there.
double cornerAngle(const glm::dvec3& at, const glm::dvec3& b, const glm::dvec3& c) {
    return std::acos(std::clamp(glm::dot(glm::normalize(b - at), glm::normalize(c - at)), -1.0, 1.0));
}

}  // namespace

void Solid::add(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    const auto first = static_cast<std::uint32_t>(points.size());
    points.insert(points.end(), {a, b, c});
    triangles.push_back({first, first + 1, first + 2});
}

void addWall(Solid& solid, std::span<const Section> sections, double spacing) {
    for (std::size_t s = 0; s + 1 < sections.size(); ++s) {
        const Section &from = sections[s], &to = sections[s + 1];
        const std::size_t n = from.outline.size();
        double height = 0;
        for (std::size_t i = 0; i < n; ++i)
            height = std::max(height, glm::distance(inSpace(from.outline[i], from.y), inSpace(to.outline[i], to.y)));
        const int rows = std::max(1, static_cast<int>(std::ceil(height / spacing - 1e-9)));
        const auto at = [&](std::size_t i, int row) {
            // The ends are exact, so that they weld with adjoining surfaces.
            if (row == 0) return inSpace(from.outline[i % n], from.y);
            if (row == rows) return inSpace(to.outline[i % n], to.y);
            const double t = double(row) / rows;
            return glm::mix(inSpace(from.outline[i % n], from.y), inSpace(to.outline[i % n], to.y), t);
        };
        for (int row = 0; row < rows; ++row)
            for (std::size_t i = 0; i < n; ++i) {
                solid.add(at(i, row), at(i + 1, row), at(i + 1, row + 1));
                solid.add(at(i, row), at(i + 1, row + 1), at(i, row + 1));
            }
    }
}

void addEnd(Solid& solid, double y, const PlanarMesh& mesh, bool up) {
    for (auto [a, b, c] : mesh.triangles) {
        if (!up) std::swap(b, c);
        solid.add(inSpace(mesh.points[a], y), inSpace(mesh.points[b], y), inSpace(mesh.points[c], y));
    }
}

engine::MeshData finished(const Solid& solid) {
    const double sharp = std::cos(30 * std::acos(-1.0) / 180);

    // Weld by the positions as they will be stored; adding 0 turns -0 into +0.
    using Key = std::tuple<float, float, float>;
    std::map<Key, std::uint32_t> known;
    std::vector<std::uint32_t> place;
    std::vector<glm::dvec3> welded;
    for (const glm::dvec3& p : solid.points) {
        const glm::vec3 q = glm::vec3(p / 1000.0) + 0.0f;
        const auto [entry, isNew] = known.try_emplace({q.x, q.y, q.z}, static_cast<std::uint32_t>(welded.size()));
        if (isNew) welded.emplace_back(q);
        place.push_back(entry->second);
    }

    // Normals of the faces, weighted by the angle at each corner.
    struct Corner {
        std::size_t face;
        glm::dvec3 weighted;
    };
    std::vector<std::array<std::uint32_t, 3>> faces;
    std::vector<glm::dvec3> faceNormals;
    std::vector<std::vector<Corner>> around(welded.size());
    for (const auto& triangle : solid.triangles) {
        const std::array<std::uint32_t, 3> face{place[triangle[0]], place[triangle[1]], place[triangle[2]]};
        if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) continue;
        const glm::dvec3 &a = welded[face[0]], &b = welded[face[1]], &c = welded[face[2]];
        const glm::dvec3 normal = glm::normalize(glm::cross(b - a, c - a));
        for (int i = 0; i < 3; ++i) {
            const double angle = cornerAngle(welded[face[i]], welded[face[(i + 1) % 3]], welded[face[(i + 2) % 3]]);
            around[face[i]].push_back({faces.size(), angle * normal});
        }
        faces.push_back(face);
        faceNormals.push_back(normal);
    }

    // A vertex is split where its faces meet in a sharp edge.
    engine::MeshData mesh;
    std::map<std::tuple<std::uint32_t, float, float, float>, std::uint32_t> corners;
    for (std::size_t f = 0; f < faces.size(); ++f)
        for (const std::uint32_t vertex : faces[f]) {
            glm::dvec3 sum(0);
            for (const Corner& corner : around[vertex])
                if (glm::dot(faceNormals[corner.face], faceNormals[f]) >= sharp) sum += corner.weighted;
            const glm::vec3 normal(glm::normalize(sum));
            const auto [entry, isNew] = corners.try_emplace({vertex, normal.x, normal.y, normal.z},
                                                            static_cast<std::uint32_t>(mesh.positions.size()));
            if (isNew) {
                mesh.positions.emplace_back(welded[vertex]);
                mesh.normals.push_back(normal);
            }
            mesh.indices.push_back(entry->second);
        }
    return mesh;
}

}  // namespace touchstone::app
