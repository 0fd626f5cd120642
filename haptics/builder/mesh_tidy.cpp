#include "haptics/builder/mesh_tidy.hpp"

#include <cmath>
#include <map>

namespace touchstone {
namespace {

// How many times farther than all others from their middle triangles are that count as far.
constexpr double kFar = 16;

MeshPatch patchAt(const Box& box, int triangles) { return {box.center(), (box.hi - box.lo).norm(), triangles}; }

Triangle triangleOf(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t) {
    return {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
}

}  // namespace

Tidied withoutSheets(const TriangleMesh& mesh, const std::vector<int>& placeOf, std::size_t vertices,
                     const std::vector<std::vector<int>>& corners, const std::vector<Corners>& kept) {
    std::vector<int> sheetOf(vertices, -1);
    std::map<Corners, int> faces;
    const auto sorted = [](Corners c) {
        std::sort(c.begin(), c.end());
        return c;
    };
    for (int s = 0; s < int(corners.size()); ++s)
        for (std::size_t i = 0; i + 2 < corners[s].size(); i += 3) {
            const Corners c{corners[s][i], corners[s][i + 1], corners[s][i + 2]};
            faces.emplace(sorted(c), s);
            for (const int v : c) sheetOf[v] = s;
        }
    for (const Corners& c : kept) {
        faces.erase(sorted(c));
        for (const int v : c) sheetOf[v] = -1;
    }
    Tidied out{{mesh.vertices, {}, mesh.grid}, {}};
    std::vector<Box> boxes(corners.size());
    std::vector<int> counts(corners.size(), 0);
    for (const auto& t : mesh.triangles) {
        const Corners c{placeOf[t[0]], placeOf[t[1]], placeOf[t[2]]};
        int sheet = -1;
        for (const int v : c) sheet = std::max(sheet, sheetOf[v]);
        if (const auto found = faces.find(sorted(c)); sheet < 0 && found != faces.end()) sheet = found->second;
        if (sheet < 0) {
            out.mesh.triangles.push_back(t);
            continue;
        }
        ++counts[sheet];
        for (const std::uint32_t v : t) boxes[sheet].add(mesh.vertices[v]);
    }
    for (std::size_t s = 0; s < corners.size(); ++s)
        if (counts[s] > 0) out.loose.push_back(patchAt(boxes[s], counts[s]));
    return out;
}

std::optional<Tidied> withoutFar(const TriangleMesh& mesh, TriangleMesh& far) {
    const std::size_t count = mesh.triangles.size(), half = count / 2;
    if (count < 3) return {};
    // The median of the triangles in each axis, and the distances of each triangle from it.
    Vec3 middle;
    std::vector<double> values(count);
    for (int axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < count; ++i) values[i] = mesh.vertices[mesh.triangles[i][0]][axis];
        std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(half), values.end());
        middle[axis] = values[half];
    }
    struct Reach {
        double nearest, farthest;
        std::size_t triangle;
    };
    std::vector<Reach> order(count);
    for (std::size_t i = 0; i < count; ++i) {
        order[i] = {HUGE_VAL, 0, i};
        for (const Vec3& v : triangleOf(mesh, mesh.triangles[i])) {
            const double distance = (v - middle).norm();
            order[i].nearest = std::min(order[i].nearest, distance);
            order[i].farthest = std::max(order[i].farthest, distance);
        }
    }
    const auto nearer = [](const Reach& a, const Reach& b) {
        return a.nearest < b.nearest || (a.nearest == b.nearest && a.triangle < b.triangle);
    };
    // Whatever is far lies beyond the nearer half. If no triangle is that far away, nothing needs to be sorted.
    std::nth_element(order.begin(), order.begin() + std::ptrdiff_t(half), order.end(), nearer);
    double reach = 0;
    for (std::size_t i = 0; i <= half; ++i) reach = std::max(reach, order[i].farthest);
    if (std::none_of(order.begin(), order.end(), [&](const Reach& r) { return r.nearest > kFar * reach; })) return {};
    // Go outward until the next triangle is too far from all before it.
    std::sort(order.begin() + std::ptrdiff_t(half), order.end(), nearer);
    std::size_t first = half + 1;
    for (; first < count && order[first].nearest <= kFar * reach; ++first)
        reach = std::max(reach, order[first].farthest);
    if (first == count) return {};

    // Separate the rest, unless it is a large part of the area.
    std::vector<char> isFar(count, 0);
    for (std::size_t i = first; i < count; ++i) isFar[order[i].triangle] = 1;
    Tidied out{{mesh.vertices, {}, mesh.grid}, {}};
    far = {mesh.vertices, {}, mesh.grid};
    double nearArea = 0, farArea = 0;
    Box box;
    for (std::size_t i = 0; i < count; ++i) {
        const Triangle t = triangleOf(mesh, mesh.triangles[i]);
        (isFar[i] ? farArea : nearArea) += areaOf(t);
        (isFar[i] ? far : out.mesh).triangles.push_back(mesh.triangles[i]);
        if (isFar[i])
            for (const Vec3& v : t) box.add(v);
    }
    if (!(farArea > 0 && farArea <= kLooseSheets * nearArea)) return {};
    out.loose.push_back(patchAt(box, int(count - first)));
    return out;
}

}  // namespace touchstone
