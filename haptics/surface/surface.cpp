#include "haptics/surface/surface.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace touchstone {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
/// Rounding of a coordinate in float, as a fraction of the part's size, and of an angle, rad.
constexpr float kBoxGuard = 4 * 0x1p-24f, kAngleGuard = 1e-5f;
/// Maximum number of spokes of a vertex whose cone is computed from all pairs of them. A vertex with more gets a half
/// space, which is correct and finds more pairs.
constexpr int kManySpokes = 24;

template <class T>
std::vector<T> reordered(const std::vector<T>& from, const std::vector<int>& order) {
    std::vector<T> out;
    out.reserve(from.size());
    for (const int i : order) out.push_back(from[i]);
    return out;
}

/// The outward normals of planes that touch the material around a vertex in that point lie in the cone opposite to its
/// spokes: those m with m·spoke <= 0 for all of them. The extreme ones are normal to two spokes.
void boundNormals(const std::vector<Vec3>& spokes, FeatureShape& bounds) {
    Vec3 inward = Vec3::Zero();
    for (const Vec3& spoke : spokes) inward += spoke;
    bounds.axis = (-inward).normalized().cast<float>();
    bounds.angle = kPi;
    if (!(inward.norm() > 1e-6)) return;
    if (int(spokes.size()) > kManySpokes) {
        bounds.angle = kPi / 2 + kAngleGuard;  // the sum of the spokes lies in their hull
        return;
    }
    std::vector<Vec3> extreme;
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < spokes.size(); ++i)
        for (std::size_t k = i + 1; k < spokes.size(); ++k)
            for (const double sign : {-1.0, 1.0}) {
                const Vec3 m = sign * spokes[i].cross(spokes[k]);
                const double length = m.norm();
                if (length < 1e-9) continue;
                const bool opposite =
                    std::all_of(spokes.begin(), spokes.end(), [&](const Vec3& s) { return m.dot(s) <= 1e-7 * length; });
                if (!opposite) continue;
                extreme.push_back(m / length);
                sum += extreme.back();
            }
    if (extreme.size() < 3 || sum.norm() < 1e-3) {
        bounds.angle = kPi / 2 + kAngleGuard;
        return;
    }
    const Vec3 middle = sum.normalized();
    double least = 1;
    for (const Vec3& m : extreme) least = std::min(least, m.dot(middle));
    if (least <= 0) {
        bounds.angle = kPi / 2 + kAngleGuard;
        return;
    }
    bounds.axis = middle.cast<float>();
    bounds.angle = float(std::acos(std::min(1.0, least))) + 1e-3f;
}

/// The center of the bounding box.
Vec3 centerOf(const std::vector<Vec3>& points) {
    Eigen::AlignedBox3d box;
    for (const Vec3& p : points) box.extend(p);
    return box.center();
}

/// One point of each group of faces that are connected by points.
std::vector<int> findShells(const SurfaceFeatures& features) {
    std::vector<int> parent(features.points.size());
    for (int i = 0; i < int(parent.size()); ++i) parent[i] = i;
    const auto root = [&](int i) {
        while (parent[i] != i) i = parent[i] = parent[parent[i]];
        return i;
    };
    for (const SurfaceFeatures::Face& face : features.faces)
        for (int k = 1; k < 3; ++k) parent[root(face.points[k])] = root(face.points[0]);
    std::vector<int> shells;
    for (const SurfaceFeatures::Face& face : features.faces) shells.push_back(root(face.points[0]));
    std::sort(shells.begin(), shells.end());
    shells.erase(std::unique(shells.begin(), shells.end()), shells.end());
    return shells;
}

}  // namespace

Surface::Surface(SurfaceFeatures from) : features(std::move(from)), extent(centerOf(features.points)) {
    for (const std::size_t n : {features.vertices.size(), features.edges.size(), features.faces.size()})
        if (n > kMaxFeatures)
            throw std::invalid_argument("the part has more than 67 million triangles: reduce its mesh");
    for (const Vec3& p : features.points) {
        extent.add(p);
        points.push_back((p - extent.center).cast<float>());
    }
    const float guard = kBoxGuard * float(extent.reach);
    const auto shapeOf = [&](int a, int b, int c) { return FeatureShape{{points[a], points[b], points[c]}, {}, 0}; };
    std::vector<FeatureShape> shapes;
    std::vector<int> order;

    for (const SurfaceFeatures::Face& face : features.faces) {
        shapes.push_back(shapeOf(face.points[0], face.points[1], face.points[2]));
        shapes.back().axis = face.normal.cast<float>();
        shapes.back().angle = kAngleGuard;
    }
    faces = FeatureTree(shapes, guard, order);
    std::vector<int> place(order.size());
    for (int i = 0; i < int(order.size()); ++i) place[order[i]] = i;
    features.faces = reordered(features.faces, order);
    for (SurfaceFeatures::Edge& edge : features.edges)
        for (int& face : edge.faces) face = place[face];
    for (const SurfaceFeatures::Face& face : features.faces) normals.push_back(face.normal.cast<float>());

    shapes.clear();
    for (const SurfaceFeatures::Edge& edge : features.edges) {
        const Vec3 &a = features.faces[edge.faces[0]].normal, &b = features.faces[edge.faces[1]].normal;
        shapes.push_back(shapeOf(edge.points[0], edge.points[1], edge.points[1]));
        const Vec3 middle = a + b;
        const bool thin = middle.norm() < 1e-3;
        shapes.back().axis = (thin ? a : middle.normalized()).cast<float>();
        shapes.back().angle = thin ? kPi : float(std::atan2(a.cross(b).norm(), a.dot(b)) / 2) + kAngleGuard;
    }
    edges = FeatureTree(shapes, guard, order);
    features.edges = reordered(features.edges, order);
    for (const SurfaceFeatures::Edge& edge : features.edges) {
        const Vec3 along = (features.points[edge.points[1]] - features.points[edge.points[0]]).normalized();
        wings.push_back({features.faces[edge.faces[0]].normal.cross(along).cast<float>(),
                         along.cross(features.faces[edge.faces[1]].normal).cast<float>()});
    }

    shapes.clear();
    std::vector<Vec3> directions;
    const auto collect = [&](const SurfaceFeatures::Vertex& vertex) {
        directions.clear();
        for (int k = 0; k < vertex.spokes; ++k)
            directions.push_back(
                (features.points[features.spokes[vertex.firstSpoke + k]] - features.points[vertex.point]).normalized());
    };
    for (const SurfaceFeatures::Vertex& vertex : features.vertices) {
        shapes.push_back(shapeOf(vertex.point, vertex.point, vertex.point));
        collect(vertex);
        boundNormals(directions, shapes.back());
    }
    vertices = FeatureTree(shapes, guard, order);
    features.vertices = reordered(features.vertices, order);
    tips = reordered(shapes, order);
    std::vector<int> sorted;
    for (SurfaceFeatures::Vertex& vertex : features.vertices) {
        collect(vertex);
        const int first = int(sorted.size());
        for (int k = 0; k < vertex.spokes; ++k) {
            sorted.push_back(features.spokes[vertex.firstSpoke + k]);
            spokes.push_back(directions[k].cast<float>());
        }
        vertex.firstSpoke = first;
    }
    features.spokes = std::move(sorted);
    shells = findShells(features);
}

BoxPlacement placementOf(const Surface& tool, const Surface& obstacle, const Pose& X_OT) {
    const Vec3 offset = X_OT * tool.extent.center - obstacle.extent.center;
    return {X_OT.R().cast<float>(), offset.cast<float>(),
            float(16 * 0x1p-24 * (tool.extent.reach + obstacle.extent.reach + offset.norm()) + 1e-7)};
}

}  // namespace touchstone
