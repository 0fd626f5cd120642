#include "tools/parts/planar.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>

namespace touchstone::app {
namespace {

using Index = std::uint32_t;
constexpr Index kNone = ~Index{0};

double cross(glm::dvec2 a, glm::dvec2 b) { return a.x * b.y - a.y * b.x; }

double distanceToEdge(glm::dvec2 p, glm::dvec2 a, glm::dvec2 b) {
    const double t = std::clamp(glm::dot(p - a, b - a) / glm::dot(b - a, b - a), 0.0, 1.0);
    return glm::distance(p, a + t * (b - a));
}

/// True for a point inside, by the even-odd rule along a ray to +x.
bool inside(const Outline& outline, glm::dvec2 p) {
    bool in = false;
    for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
        const glm::dvec2 a = outline[i], b = outline[j];
        if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)) in = !in;
    }
    return in;
}

double distanceTo(const Outline& outline, glm::dvec2 p) {
    double least = 1e300;
    for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++)
        least = std::min(least, distanceToEdge(p, outline[j], outline[i]));
    return least;
}

/// Incremental Delaunay triangulation by Lawson's flips inside a triangle that contains all. Points are scaled to the
/// unit square and the predicates are evaluated in long double, so that kEpsilon separates cocircular points from
/// errors.
class Delaunay {
  public:
    struct Triangle {
        std::array<Index, 3> v;     // counter-clockwise
        std::array<Index, 3> next;  // neighbor beyond the edge opposite v[i]
    };

    Delaunay(glm::dvec2 low, glm::dvec2 high) : origin_(low), scale_(1 / std::max(high.x - low.x, high.y - low.y)) {
        points_ = {{-20, -20}, {21, -20}, {0.5, 30}};
        triangles_.push_back({{0, 1, 2}, {kNone, kNone, kNone}});
    }

    /// Returns the point's index; the corners of the outer triangle are 0 to 2.
    Index insert(glm::dvec2 point) {
        const Index p = static_cast<Index>(points_.size());
        points_.push_back((point - origin_) * scale_);
        const Index t = locate(p);
        const auto [v, next] = triangles_[t];
        const Index first = static_cast<Index>(triangles_.size());
        const std::array<Index, 3> parts{t, first, first + 1};
        triangles_.resize(triangles_.size() + 2);
        for (int i = 0; i < 3; ++i) {  // part i keeps the edge opposite v[i]
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            triangles_[parts[i]] = {{p, v[j], v[k]}, {next[i], parts[j], parts[k]}};
            if (next[i] != kNone) redirect(next[i], t, parts[i]);
        }
        for (const Index part : parts) legalise(part);
        return p;
    }

    const std::vector<Triangle>& triangles() const { return triangles_; }

  private:
    static constexpr long double kEpsilon = 1e-15L;

    long double orient(Index a, Index b, Index c) const {
        const glm::dvec2 &A = points_[a], &B = points_[b], &C = points_[c];
        return (static_cast<long double>(B.x) - A.x) * (static_cast<long double>(C.y) - A.y) -
               (static_cast<long double>(B.y) - A.y) * (static_cast<long double>(C.x) - A.x);
    }

    bool inCircle(Index a, Index b, Index c, Index d) const {
        const auto row = [&](Index i) {
            const long double x = static_cast<long double>(points_[i].x) - points_[d].x;
            const long double y = static_cast<long double>(points_[i].y) - points_[d].y;
            return std::array<long double, 3>{x, y, x * x + y * y};
        };
        const auto A = row(a), B = row(b), C = row(c);
        return A[0] * (B[1] * C[2] - B[2] * C[1]) - A[1] * (B[0] * C[2] - B[2] * C[0]) +
                   A[2] * (B[0] * C[1] - B[1] * C[0]) >
               kEpsilon;
    }

    /// Walks toward the point from the newest triangle.
    Index locate(Index p) const {
        Index t = static_cast<Index>(triangles_.size() - 1);
        for (std::size_t steps = 0; steps <= triangles_.size(); ++steps) {
            const Triangle& triangle = triangles_[t];
            Index beyond = kNone;
            for (int i = 0; i < 3; ++i)
                if (orient(triangle.v[(i + 1) % 3], triangle.v[(i + 2) % 3], p) < 0) beyond = triangle.next[i];
            if (beyond == kNone) return t;
            t = beyond;
        }
        throw std::invalid_argument("the outline has points that coincide; remove them");
    }

    void redirect(Index t, Index from, Index to) {
        std::replace(triangles_[t].next.begin(), triangles_[t].next.end(), from, to);
    }

    /// Flips the edge opposite v[0], the newest point, while the empty-circle criterion is violated.
    void legalise(Index t) {
        std::vector<Index> open{t};
        while (!open.empty()) {
            t = open.back();
            open.pop_back();
            const auto [v, next] = triangles_[t];
            const Index u = next[0];
            if (u == kNone) continue;
            const int j = static_cast<int>(std::ranges::find(triangles_[u].next, t) - triangles_[u].next.begin());
            const Index apex = triangles_[u].v[j];
            // A point on the edge makes a triangle of zero area, which has no circumcircle: it must be flipped away.
            const bool flat = orient(v[0], v[1], v[2]) <= kEpsilon;
            if (!flat && !inCircle(v[0], v[1], v[2], apex)) continue;
            if (orient(v[0], v[1], apex) < 0 || orient(v[0], apex, v[2]) < 0) continue;
            const Index beside1 = triangles_[u].next[(j + 1) % 3], beside2 = triangles_[u].next[(j + 2) % 3];
            // u = (apex, v2, v1) in its own order: beside1 lies across (v1, apex), beside2 across (apex, v2).
            triangles_[t] = {{v[0], v[1], apex}, {beside1, u, next[2]}};
            triangles_[u] = {{v[0], apex, v[2]}, {beside2, next[1], t}};
            if (beside1 != kNone) redirect(beside1, u, t);
            if (next[1] != kNone) redirect(next[1], t, u);
            open.push_back(t);
            open.push_back(u);
        }
    }

    glm::dvec2 origin_;
    double scale_;
    std::vector<glm::dvec2> points_;
    std::vector<Triangle> triangles_;
};

}  // namespace

Outline polygon(double radius, int corners) {
    Outline outline;
    for (int i = 0; i < corners; ++i) {
        const double angle = 2 * std::numbers::pi * i / corners;
        outline.push_back({radius * std::cos(angle), radius * std::sin(angle)});
    }
    return outline;
}

Outline circle(double radius, double chordError, double spacing) {
    const double half = std::min(std::acos(1 - chordError / radius), std::asin(std::min(spacing / (2 * radius), 1.0)));
    return polygon(radius, std::max(8, static_cast<int>(std::ceil(std::numbers::pi / half))));
}

void require(bool holds, const char* sentence) {
    if (!holds) throw std::invalid_argument(sentence);
}

void addArc(Outline& outline, double radius, double from, double to, double chordError, double spacing) {
    const double step = std::min(2 * std::acos(1 - chordError / radius), spacing / radius);
    const int pieces = std::max(1, static_cast<int>(std::ceil((to - from) / step)));
    for (int i = 0; i <= pieces; ++i) {
        const double angle = from + (to - from) * i / pieces;
        outline.push_back({radius * std::cos(angle), radius * std::sin(angle)});
    }
}

Outline offset(const Outline& outline, double distance) {
    if (distance == 0) return outline;  // bit-identical, so that solids that share the outline stay closed
    struct Edge {
        glm::dvec2 point, direction;
    };
    const std::size_t n = outline.size();
    std::vector<Edge> edges;
    for (std::size_t i = 0; i < n; ++i) {
        const glm::dvec2 along = glm::normalize(outline[(i + 1) % n] - outline[i]);
        edges.push_back({outline[i] + distance * glm::dvec2(along.y, -along.x), along});
    }
    const auto meet = [&](std::size_t i, std::size_t j) {
        const double sine = cross(edges[i].direction, edges[j].direction);
        if (std::abs(sine) < 1e-9) return edges[j].point;  // collinear edges: the shared point has moved with them
        return edges[i].point +
               edges[i].direction * (cross(edges[j].point - edges[i].point, edges[j].direction) / sine);
    };
    // Drop the most reversed edge until no edge is reversed; its neighbors then meet each other.
    std::vector<std::size_t> kept(n);
    for (std::size_t i = 0; i < n; ++i) kept[i] = i;
    while (true) {
        if (kept.size() < 3) throw std::invalid_argument("the offset is larger than the outline is wide");
        const std::size_t m = kept.size();
        std::size_t worst = m;
        double least = 0;
        for (std::size_t i = 0; i < m; ++i) {
            const std::size_t before = kept[(i + m - 1) % m], after = kept[(i + 1) % m];
            const double length = glm::dot(meet(kept[i], after) - meet(before, kept[i]), edges[kept[i]].direction);
            if (length < least) least = length, worst = i;
        }
        if (worst == m) break;
        kept.erase(kept.begin() + static_cast<std::ptrdiff_t>(worst));
    }
    // Point i starts edge i; the points of dropped edges lie where the neighboring edges meet.
    Outline result(n);
    for (std::size_t k = 0; k < kept.size(); ++k) {
        const std::size_t from = kept[k], to = kept[(k + 1) % kept.size()];
        const glm::dvec2 corner = meet(from, to);
        for (std::size_t i = (from + 1) % n;; i = (i + 1) % n) {
            result[i] = corner;
            if (i == to) break;
        }
    }
    if (signedArea(result) <= 0) throw std::invalid_argument("the offset is larger than the outline is wide");
    return result;
}

Outline withoutRepeats(const Outline& outline) {
    Outline result;
    for (std::size_t i = 0; i < outline.size(); ++i)
        if (outline[i] != outline[(i + outline.size() - 1) % outline.size()]) result.push_back(outline[i]);
    return result;
}

Outline subdivided(const Outline& outline, double spacing) {
    Outline result;
    for (std::size_t i = 0; i < outline.size(); ++i) {
        const glm::dvec2 a = outline[i], b = outline[(i + 1) % outline.size()];
        const int pieces = std::max(1, static_cast<int>(std::ceil(glm::distance(a, b) / spacing - 1e-9)));
        for (int k = 0; k < pieces; ++k) result.push_back(a + (b - a) * (double(k) / pieces));
    }
    return result;
}

double signedArea(const Outline& outline) {
    double twice = 0;
    for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) twice += cross(outline[j], outline[i]);
    return twice / 2;
}

PlanarMesh triangulate(const Outline& outer, const Outline& hole, double spacing) {
    glm::dvec2 low = outer[0], high = outer[0];
    for (const glm::dvec2& p : outer) low = glm::min(low, p), high = glm::max(high, p);

    PlanarMesh mesh;
    mesh.points = outer;
    mesh.points.insert(mesh.points.end(), hole.begin(), hole.end());
    // Hexagonal grid, symmetric about the center, at a distance from the outlines so that no thin triangles arise
    // there.
    const glm::dvec2 center = (low + high) / 2.0, reach = (high - low) / 2.0;
    const double rowHeight = spacing * std::sqrt(0.75);
    const int rows = static_cast<int>(reach.y / rowHeight), columns = static_cast<int>(reach.x / spacing) + 1;
    for (int row = -rows; row <= rows; ++row)
        for (int column = -columns; column <= columns; ++column) {
            const glm::dvec2 p = center + glm::dvec2((column + (row & 1) * 0.5) * spacing, row * rowHeight);
            if (!inside(outer, p) || distanceTo(outer, p) < 0.6 * spacing) continue;
            if (!hole.empty() && (inside(hole, p) || distanceTo(hole, p) < 0.6 * spacing)) continue;
            mesh.points.push_back(p);
        }

    Delaunay delaunay(low, high);
    for (const glm::dvec2& p : mesh.points) delaunay.insert(p);

    // Directed edges with the region on their left; the flood fill from triangle to triangle stops at them.
    std::map<std::pair<Index, Index>, bool> border;
    const auto addLoop = [&](std::size_t first, std::size_t count, bool reversed) {
        for (std::size_t i = 0; i < count; ++i) {
            Index a = static_cast<Index>(first + i + 3), b = static_cast<Index>(first + (i + 1) % count + 3);
            if (reversed) std::swap(a, b);
            border[{a, b}] = false;
        }
    };
    addLoop(0, outer.size(), false);
    addLoop(outer.size(), hole.size(), true);

    // The fill begins at the triangles beside the border, whose edges must all be present.
    const auto& triangles = delaunay.triangles();
    std::vector<char> taken(triangles.size(), 0);
    std::vector<Index> open;
    for (Index t = 0; t < triangles.size(); ++t)
        for (int i = 0; i < 3; ++i) {
            const auto found = border.find({triangles[t].v[(i + 1) % 3], triangles[t].v[(i + 2) % 3]});
            if (found == border.end()) continue;
            found->second = true;
            if (!taken[t]) taken[t] = 1, open.push_back(t);
        }
    for (const auto& [edge, present] : border)
        if (!present)
            throw std::invalid_argument(
                "an outline's edges are too long for the narrowest place beside them; "
                "use a smaller spacing");
    while (!open.empty()) {
        const Delaunay::Triangle& triangle = triangles[open.back()];
        open.pop_back();
        mesh.triangles.push_back({triangle.v[0] - 3, triangle.v[1] - 3, triangle.v[2] - 3});
        for (int i = 0; i < 3; ++i) {
            const Index beyond = triangle.next[i];
            if (beyond == kNone || taken[beyond] || border.contains({triangle.v[(i + 1) % 3], triangle.v[(i + 2) % 3]}))
                continue;
            taken[beyond] = 1;
            open.push_back(beyond);
        }
    }
    return mesh;
}

}  // namespace touchstone::app
