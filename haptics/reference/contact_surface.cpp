#include "haptics/reference/contact_surface.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>

namespace touchstone {
namespace {

/// Faces whose planes differ by less than this angle count as one plane, rad, so that the edge between them is neither
/// a ridge nor a valley.
constexpr double kFlat = 1e-6;

}  // namespace

Triangle ContactSurface::triangle(int face) const {
    const auto& v = faces[face].vertices;
    return {vertices[v[0]], vertices[v[1]], vertices[v[2]]};
}

Vec3 ContactSurface::normal(int face) const {
    const auto [a, b, c] = triangle(face);
    return (b - a).cross(c - a).normalized();
}

Box ContactSurface::box(int face) const {
    Box box;
    for (const int v : faces[face].vertices) box.add(vertices[v]);
    return box;
}

ContactSurface makeContactSurface(const TriangleMesh& mesh) {
    ContactSurface surface;
    std::map<std::array<double, 3>, int> places;
    std::vector<int> vertexOf;
    for (const Vec3& p : mesh.vertices) {
        // Adding 0 makes -0 and 0 equal keys.
        const auto [place, added] = places.emplace(std::array{p.x() + 0, p.y() + 0, p.z() + 0}, int(places.size()));
        if (added) surface.vertices.push_back(p);
        vertexOf.push_back(place->second);
    }
    std::map<std::pair<int, int>, int> edges;
    for (const auto& corners : mesh.triangles) {
        ContactSurface::Face face;
        for (int k = 0; k < 3; ++k) face.vertices[k] = vertexOf[corners[k]];
        const auto& v = face.vertices;
        const Vec3 ab = surface.vertices[v[1]] - surface.vertices[v[0]],
                   ac = surface.vertices[v[2]] - surface.vertices[v[0]];
        if (ab.cross(ac).norm() <= 1e-12 * std::max(ab.squaredNorm(), ac.squaredNorm())) continue;
        for (int k = 0; k < 3; ++k) {
            const int a = v[k], b = v[(k + 1) % 3];
            const auto [edge, added] = edges.emplace(std::minmax(a, b), int(edges.size()));
            if (added) surface.edges.push_back({{a, b}, {}});
            surface.edges[edge->second].wings.push_back(v[(k + 2) % 3]);
            face.edges[k] = edge->second;
        }
        surface.faces.push_back(face);
    }
    if (surface.faces.empty()) throw std::invalid_argument("the mesh has no triangle with an area: check the file");
    surface.neighbors.resize(surface.vertices.size());
    for (const ContactSurface::Edge& edge : surface.edges)
        for (int k = 0; k < 2; ++k) surface.neighbors[edge.vertices[k]].push_back(edge.vertices[1 - k]);
    return surface;
}

Vec3 closestPoint(const ContactSurface& surface, int face, const Vec3& p, Feature& feature) {
    const ContactSurface::Face& f = surface.faces[face];
    const Triangle corners = surface.triangle(face);
    const Vec3 q = closestPoint(p, corners, false);
    // At a corner the function returns the corner itself. On a side, one barycentric coordinate is zero up to rounding.
    for (int k = 0; k < 3; ++k)
        if (q == corners[k]) {
            feature = {Feature::Kind::Vertex, f.vertices[k]};
            return q;
        }
    const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    for (int k = 0; k < 3; ++k) {
        const Vec3 side = corners[(k + 1) % 3] - corners[k];
        const double inside = normal.cross(side).dot(q - corners[k]);
        if (inside <= 1e-12 * normal.norm() * side.squaredNorm()) {
            feature = {Feature::Kind::Edge, f.edges[k]};
            return q;
        }
    }
    feature = {Feature::Kind::Face, face};
    return q;
}

bool standsOut(const ContactSurface& surface, const Feature& feature, const Vec3& at, const Vec3& normal) {
    if (feature.kind == Feature::Kind::Face) return true;
    const std::vector<int>& around =
        feature.kind == Feature::Kind::Edge ? surface.edges[feature.index].wings : surface.neighbors[feature.index];
    return std::all_of(around.begin(), around.end(), [&](int v) {
        const Vec3 way = surface.vertices[v] - at;
        return way.dot(normal) <= kFlat * way.norm();
    });
}

bool crossing(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1, double& s, double& t) {
    const Vec3 u = a1 - a0, v = b1 - b0, w = a0 - b0;
    const double uu = u.squaredNorm(), uv = u.dot(v), vv = v.squaredNorm(), uw = u.dot(w), vw = v.dot(w);
    const double det = uu * vv - uv * uv;
    if (det <= 1e-12 * uu * vv) return false;
    s = (uv * vw - vv * uw) / det;
    t = (uu * vw - uv * uw) / det;
    return true;
}

bool pierces(const Vec3& a, const Vec3& b, const Triangle& triangle) {
    const Vec3 ab = triangle[1] - triangle[0], ac = triangle[2] - triangle[0], way = b - a, n = ab.cross(ac);
    const double da = n.dot(a - triangle[0]), db = n.dot(b - triangle[0]);
    if ((da > 0) == (db > 0)) return false;
    const Vec3 q = a + way * (da / (da - db));
    for (int k = 0; k < 3; ++k)
        if (n.cross(triangle[(k + 1) % 3] - triangle[k]).dot(q - triangle[k]) < 0) return false;
    return true;
}

}  // namespace touchstone
