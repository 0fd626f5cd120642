#include "haptics/surface/surface.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "haptics/surface/feature_lanes.hpp"

namespace touchstone {

using namespace simd;

namespace {

/// Rounding of a coordinate in float, as a fraction of the part's size.
constexpr float kBoxGuard = 4 * 0x1p-24f;
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

/// Sorts features by patch, in a stable way. Returns the first feature of each patch, and the end of the last one.
template <class T, class PatchOf>
std::vector<int> sortByPatch(std::vector<T>& all, int patches, PatchOf&& patchOf) {
    std::vector<int> first(patches + 2, 0), order(all.size());
    for (const T& feature : all) ++first[patchOf(feature) + 2];
    std::partial_sum(first.begin(), first.end(), first.begin());
    for (int i = 0; i < int(all.size()); ++i) order[first[patchOf(all[i]) + 1]++] = i;
    first.pop_back();
    all = reordered(all, order);
    return first;
}

Surface::Record recordOf(const std::array<Eigen::Vector3f, 4>& vectors) {
    Surface::Record record;
    for (std::size_t i = 0; i < record.size(); ++i) record[i] = vectors[i / 3][int(i % 3)];
    return record;
}

/// The outward normals of planes that touch the material around a vertex in that point alone lie in the cone opposite
/// to its spokes: those m with m·spoke <= 0 for all of them. The extreme ones are normal to two spokes.
NormalCone coneOf(const std::vector<Vec3>& spokes) {
    Vec3 inward = Vec3::Zero();
    for (const Vec3& spoke : spokes) inward += spoke;
    const NormalCone half{(-inward).normalized().cast<float>(), std::numbers::pi_v<float> / 2 + kAngleGuard};
    if (!(inward.norm() > 1e-6)) return {half.axis, std::numbers::pi_v<float>};
    if (int(spokes.size()) > kManySpokes) return half;  // the sum of the spokes lies in their hull
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
    if (extreme.size() < 3 || sum.norm() < 1e-3) return half;
    const Vec3 middle = sum.normalized();
    double least = 1;
    for (const Vec3& m : extreme) least = std::min(least, m.dot(middle));
    if (least <= 0) return half;
    return {middle.cast<float>(), float(std::acos(std::min(1.0, least))) + 1e-3f};
}

/// The center of the bounding box.
Vec3 centerOf(const std::vector<Vec3>& points) {
    Eigen::AlignedBox3d box;
    for (const Vec3& p : points) box.extend(p);
    return box.center();
}

/// One face of each group of faces that are connected by points.
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
    std::vector<char> found(features.points.size());
    for (int f = 0; f < int(features.faces.size()); ++f)
        if (!std::exchange(found[std::size_t(root(features.faces[f].points[0]))], 1)) shells.push_back(f);
    return shells;
}

}  // namespace

Surface::Surface(SurfaceFeatures from) : features(std::move(from)), extent(centerOf(features.points)) {
    for (const std::size_t n : {features.vertices.size(), features.edges.size(), features.faces.size()})
        if (n > kMaxFeatures)
            throw std::invalid_argument("the part has more than 67 million triangles: reduce its mesh");
    features.points.shrink_to_fit();
    points.reserve(features.points.size());
    for (const Vec3& p : features.points) {
        extent.add(p);
        points.push_back((p - extent.center).cast<float>());
    }
    const std::vector<int> order = faceOrder();
    std::vector<int> place(order.size()), patchOf(points.size(), 0);
    for (int i = 0; i < int(order.size()); ++i) place[order[i]] = i;
    features.faces = reordered(features.faces, order);
    for (SurfaceFeatures::Edge& edge : features.edges)
        for (int& face : edge.faces) face = place[face];
    // Edges and vertices belong to the patch of the first face that has them.
    for (int f = int(order.size()) - 1; f >= 0; --f)
        for (const int p : features.faces[f].points) patchOf[p] = f / FeatureTree::kChildren;
    const int patches = (int(order.size()) + FeatureTree::kChildren - 1) / FeatureTree::kChildren;
    firstEdge = sortByPatch(features.edges, patches, [](const SurfaceFeatures::Edge& edge) {
        return std::min(edge.faces[0], edge.faces[1]) / FeatureTree::kChildren;
    });
    firstVertex = sortByPatch(features.vertices, patches,
                              [&](const SurfaceFeatures::Vertex& vertex) { return patchOf[vertex.point]; });

    const float guard = kBoxGuard * float(extent.reach);
    std::vector<std::array<FeatureBounds, kFeatureKinds>> bounds(patches);
    std::vector<FeatureBounds> parts;
    const auto bound = [&](std::initializer_list<int> at, const NormalCone& cone) {
        FeatureBounds& part = parts.emplace_back();
        for (const int p : at) part.add(points[p]);
        part.lo.array() -= guard;
        part.hi.array() += guard;
        part.normals = cone;
    };
    faces.reserve(order.size() + 7);
    edges.reserve(features.edges.size() + 7);
    spokes.reserve(features.spokes.size());
    tips.reserve(features.vertices.size());
    std::vector<int> sorted;
    sorted.reserve(features.spokes.size());
    std::vector<Vec3> directions;
    for (int patch = 0; patch < patches; ++patch) {
        const int first = patch * FeatureTree::kChildren;
        for (int f = first; f < first + facesOf(patch); ++f) {
            const SurfaceFeatures::Face& face = features.faces[f];
            faces.push_back(recordOf(
                {points[face.points[0]], points[face.points[1]], points[face.points[2]], face.normal.cast<float>()}));
            bound({face.points[0], face.points[1], face.points[2]}, {face.normal.cast<float>(), kAngleGuard});
        }
        bounds[patch][std::size_t(FeatureKind::Face)] = FeatureBounds::of(parts);
        parts.clear();
        for (int e = firstEdge[patch]; e < firstEdge[patch + 1]; ++e) {
            const SurfaceFeatures::Edge& edge = features.edges[e];
            const Vec3 &a = features.faces[edge.faces[0]].normal, &b = features.faces[edge.faces[1]].normal;
            const Vec3 along = (features.points[edge.points[1]] - features.points[edge.points[0]]).normalized();
            const Vec3 middle = a + b;
            edges.push_back(recordOf({points[edge.points[0]], points[edge.points[1]], a.cross(along).cast<float>(),
                                      along.cross(b).cast<float>()}));
            const bool thin = middle.norm() < 1e-3;
            bound(
                {edge.points[0], edge.points[1]},
                {(thin ? a : middle.normalized()).cast<float>(),
                 thin ? std::numbers::pi_v<float> : float(std::atan2(a.cross(b).norm(), a.dot(b)) / 2) + kAngleGuard});
        }
        bounds[patch][std::size_t(FeatureKind::Edge)] = FeatureBounds::of(parts);
        parts.clear();
        for (int v = firstVertex[patch]; v < firstVertex[patch + 1]; ++v) {
            SurfaceFeatures::Vertex& vertex = features.vertices[v];
            directions.clear();
            const int begin = std::exchange(vertex.firstSpoke, int(sorted.size()));
            for (int k = begin; k < begin + vertex.spokes; ++k) {
                sorted.push_back(features.spokes[k]);
                directions.push_back(
                    (features.points[features.spokes[k]] - features.points[vertex.point]).normalized());
                spokes.push_back(directions.back().cast<float>());
            }
            bound({vertex.point}, tips.emplace_back(coneOf(directions)));
        }
        bounds[patch][std::size_t(FeatureKind::Vertex)] = FeatureBounds::of(parts);
        parts.clear();
    }
    features.spokes = std::move(sorted);
    for (AlignedVector<Record>* records : {&faces, &edges})
        if (!records->empty()) records->resize(records->size() + 7, records->back());
    tree = FeatureTree(bounds);
    shells = findShells(features);
}

std::vector<int> Surface::faceOrder() const {
    std::vector<Eigen::Vector3f> centers;
    for (const SurfaceFeatures::Face& face : features.faces) {
        const auto &a = points[face.points[0]], &b = points[face.points[1]], &c = points[face.points[2]];
        centers.push_back(a.cwiseMin(b).cwiseMin(c) + a.cwiseMax(b).cwiseMax(c));
    }
    return FeatureTree::order(centers);
}

void Surface::faceBoxes(int patch, Float8 lo[3], Float8 hi[3]) const {
    const Float8 guard = splat(kBoxGuard * float(extent.reach));
    const Box8 box = FaceLanes(Eight(faces, patch * FeatureTree::kChildren)).box();
    lo[0] = box.lo.x - guard, lo[1] = box.lo.y - guard, lo[2] = box.lo.z - guard;
    hi[0] = box.hi.x + guard, hi[1] = box.hi.y + guard, hi[2] = box.hi.z + guard;
}

int Surface::boxesBelow(int height, int node, Float8 lo[3], Float8 hi[3]) const {
    if (height == 0) {
        faceBoxes(node, lo, hi);
        return facesOf(node);
    }
    const FeatureTree::Bounds8& children = tree.children(FeatureKind::Face, height, node);
    std::copy_n(children.lo, 3, lo);
    std::copy_n(children.hi, 3, hi);
    return tree.childCount(height, node);
}

std::size_t Surface::bytes() const {
    const auto sum = [](const auto&... lists) { return (... + (lists.capacity() * sizeof(lists[0]))); };
    const SurfaceFeatures& f = features;
    return tree.bytes() + sum(f.points, f.faces, f.edges, f.vertices, f.spokes, firstVertex, firstEdge, points, faces,
                              edges, spokes, tips, shells);
}

BoxPlacement placementOf(const Surface& tool, const Surface& obstacle, const Pose& X_OT) {
    const Vec3 offset = X_OT * tool.extent.center - obstacle.extent.center;
    return {X_OT.R().cast<float>(), offset.cast<float>(),
            float(16 * 0x1p-24 * (tool.extent.reach + obstacle.extent.reach + offset.norm()) + 1e-7)};
}

}  // namespace touchstone
