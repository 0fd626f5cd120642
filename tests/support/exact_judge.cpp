#include "tests/support/exact_judge.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Intersections_3/Triangle_3_Triangle_3.h>

#include <algorithm>
#include <map>
#include <optional>

#include "haptics/builder/box_search.hpp"
#include "haptics/builder/triangle_bvh.hpp"

namespace touchstone::test {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

Kernel::Point_3 exact(const Vec3& p) { return {p.x(), p.y(), p.z()}; }
Kernel::Triangle_3 exact(const Triangle& t) { return {exact(t[0]), exact(t[1]), exact(t[2])}; }

Triangle placed(const Triangle& t, const Pose& X) { return {X * t[0], X * t[1], X * t[2]}; }

/// One vertex of each group of triangles that are joined at vertices of equal coordinates.
std::vector<Vec3> shellsOf(const std::vector<Triangle>& triangles) {
    const auto less = [](const Vec3& a, const Vec3& b) {
        return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
    };
    std::map<Vec3, int, decltype(less)> points(less);
    std::vector<int> parent;
    const auto root = [&](int i) {
        while (parent[i] != i) i = parent[i] = parent[parent[i]];
        return i;
    };
    for (const Triangle& t : triangles) {
        int first = -1;
        for (const Vec3& p : t) {
            const auto [at, isNew] = points.try_emplace(p, int(parent.size()));
            if (isNew) parent.push_back(at->second);
            if (first < 0)
                first = root(at->second);
            else
                parent[root(at->second)] = first;
        }
    }
    std::vector<Vec3> shells;
    for (const auto& [p, i] : points)
        if (parent[i] == i) shells.push_back(p);
    return shells;
}

/// How often the ray from p leaves the surface, less how often it enters it; none if it meets an edge.
std::optional<int> crossings(const std::vector<Triangle>& triangles, const BoxTree& tree, const std::vector<Box>& boxes,
                             const Vec3& from, const Vec3& to) {
    const auto p = exact(from), q = exact(to);
    Box around;
    around.add(from);
    around.add(to);
    int count = 0;
    const bool meetsEdge = anyMeeting(tree, boxes, around, [&](int i) {
        const Kernel::Triangle_3 t = exact(triangles[i]);
        const auto before = CGAL::orientation(t[0], t[1], t[2], p), after = CGAL::orientation(t[0], t[1], t[2], q);
        if (before == after && before != CGAL::COPLANAR) return false;
        std::array<CGAL::Orientation, 3> sides;
        for (int k = 0; k < 3; ++k) sides[k] = CGAL::orientation(p, q, t[k], t[(k + 1) % 3]);
        const auto [low, high] = std::minmax_element(sides.begin(), sides.end());
        if (*low == CGAL::NEGATIVE && *high == CGAL::POSITIVE) return false;
        if (before == CGAL::COPLANAR || after == CGAL::COPLANAR || *low == CGAL::COPLANAR || *high == CGAL::COPLANAR)
            return true;
        count += before == CGAL::NEGATIVE ? 1 : -1;
        return false;
    });
    return meetsEdge ? std::nullopt : std::optional(count);
}

}  // namespace

struct ExactJudge::Part {
    explicit Part(const TriangleMesh& mesh) : Part(trianglesOf(mesh)) {}
    explicit Part(const std::vector<Triangle>& given)
        : tree(boxesOf(given)),
          triangles(inOrder(tree.order(), given)),
          boxes(boxesOf(triangles)),
          shells(shellsOf(given)) {
        for (const Box& box : boxes) all.add(box);
    }

    static std::vector<Triangle> trianglesOf(const TriangleMesh& mesh) {
        std::vector<Triangle> out;
        for (const auto& t : mesh.triangles) {
            const Triangle corners{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
            if (!exact(corners).is_degenerate()) out.push_back(corners);  // those are edges of their neighbors
        }
        return out;
    }

    bool contains(const Vec3& point) const {
        if (((point - all.lo).array() < 0).any() || ((point - all.hi).array() > 0).any()) return false;
        // Rays along x, almost: their boxes are slender. A ray that meets an edge is replaced by another.
        for (int attempt = 1;; ++attempt) {
            const double length = 2 * all.diagonal() + 1, tilt = 0.0123 + 0.00077 * attempt;
            if (const auto n = crossings(triangles, tree, boxes, point, point + length * Vec3(1, tilt, 0.7 * tilt)))
                return *n != 0;
        }
    }

    BoxTree tree;
    std::vector<Triangle> triangles;  ///< in the tree's order, as the boxes
    std::vector<Box> boxes;
    Box all;
    std::vector<Vec3> shells;
};

ExactJudge::ExactJudge(const TriangleMesh& tool, const TriangleMesh& obstacle)
    : tool_(std::make_unique<Part>(tool)), obstacle_(std::make_unique<Part>(obstacle)) {}
ExactJudge::~ExactJudge() = default;
ExactJudge::ExactJudge(ExactJudge&&) noexcept = default;

int ExactJudge::intersections(const Pose& X_OT, int atMost) const {
    const Mat3 R = X_OT.R(), size = R.cwiseAbs();
    const double guard = 1e-9 * (1 + X_OT.p.norm() + tool_->all.lo.norm() + tool_->all.hi.norm());
    const auto boxOf = [&](const BoxTree::Node& node, int k) {
        const Vec3 lo(node.lo[0][k], node.lo[1][k], node.lo[2][k]), hi(node.hi[0][k], node.hi[1][k], node.hi[2][k]);
        const Vec3 center = R * (0.5 * (lo + hi)) + X_OT.p, half = (size * (0.5 * (hi - lo))).array() + guard;
        return Box{center - half, center + half};
    };
    int found = 0;
    std::vector<int> waiting{0};
    while (!waiting.empty() && found < atMost) {
        const BoxTree::Node& node = tool_->tree.nodes()[waiting.back()];
        waiting.pop_back();
        for (int k = 0; k < 4; ++k) {
            if (node.count[k] < 0) continue;
            const Box box = boxOf(node, k);
            if (node.count[k] == 0) {
                if (anyMeeting(obstacle_->tree, obstacle_->boxes, box, [](int) { return true; }))
                    waiting.push_back(node.first[k]);
                continue;
            }
            for (int i = node.first[k]; i < node.first[k] + node.count[k]; ++i) {
                const Triangle t = placed(tool_->triangles[i], X_OT);
                if (exact(t).is_degenerate()) continue;  // by the rounding of its place
                Box own;
                for (const Vec3& p : t) own.add(p);
                anyMeeting(obstacle_->tree, obstacle_->boxes, own, [&](int j) {
                    found += CGAL::do_intersect(exact(t), exact(obstacle_->triangles[j]));
                    return found >= atMost;
                });
            }
        }
    }
    return std::min(found, atMost);
}

bool ExactJudge::contained(const Pose& X_OT) const {
    const auto inside = [](const Part& inner, const Part& outer, const Pose& X) {
        return std::any_of(inner.shells.begin(), inner.shells.end(),
                           [&](const Vec3& p) { return outer.contains(X * p); });
    };
    return inside(*tool_, *obstacle_, X_OT) || inside(*obstacle_, *tool_, X_OT.inverse());
}

}  // namespace touchstone::test
