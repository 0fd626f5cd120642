#include "haptics/builder/mesh_caps.hpp"

#include <cmath>
#include <map>

namespace touchstone {
namespace {

constexpr std::size_t kMostFlat = 400, kMostSmooth = 100;  // most edges: time is cubic in their number
// Deviation from a plane of a flat hole, as a share of its extent: above the rounding of files, below what is felt.
constexpr double kFlatness = 1e-3;
constexpr double kGoesOn = 0.8660254037844386;  // cosine of 30°: up to it a face continues the one beside it
constexpr double kLevel = 0.9998476951563913;   // cosine of 1°: up to it a face lies in the plane of the other
constexpr double kFolded = -0.5;                // cosine of 120°: a cap that bends by more turns back
// Bend up to which an edge costs more the more it bends, as 1 - cosine: beyond, a sharp edge is a corner of the part.
constexpr double kCorner = 0.034;      // 15°
constexpr double kThinnestEar = 1e-9;  // least area of a flat cap's triangle, as a share of the squared extent
constexpr double kImpossible = HUGE_VAL;

double extentOf(const std::vector<Vec3>& vertices, const RimLoop& loop) {
    Box box;
    for (const RimEdge& e : loop) box.add(vertices[e.from]);
    return (box.hi - box.lo).norm();
}

/// Half the sum of the cross products along the loop: normal to it, with its area as length.
Vec3 areaVector(const std::vector<Vec3>& vertices, const RimLoop& loop) {
    const Vec3& base = vertices[loop.front().from];
    Vec3 sum = Vec3::Zero();
    for (const RimEdge& e : loop) sum += (vertices[e.from] - base).cross(vertices[e.to] - base) / 2;
    return sum;
}

/// Whether all vertices of the loop lie in the plane.
bool liesIn(const std::vector<Vec3>& vertices, const RimLoop& loop, const Vec3& base, const Vec3& normal,
            double tolerance) {
    return std::all_of(loop.begin(), loop.end(),
                       [&](const RimEdge& e) { return std::abs(normal.dot(vertices[e.from] - base)) <= tolerance; });
}

/// Whether the loop, which is flat, runs around the point of its plane.
bool surrounds(const std::vector<Vec3>& vertices, const RimLoop& loop, const Vec3& normal, const Vec3& point) {
    double turn = 0;
    for (const RimEdge& e : loop) {
        const Vec3 a = vertices[e.from] - point, b = vertices[e.to] - point;
        turn += std::atan2(normal.dot(a.cross(b)), a.dot(b));
    }
    return std::abs(turn) > 3;
}

/// Opens the loop at the vertex of it and the vertex of the island that are nearest, and runs around the island there.
void bridge(const std::vector<Vec3>& vertices, RimLoop& loop, const RimLoop& island) {
    std::size_t at = 0, other = 0;
    double nearest = HUGE_VAL;
    for (std::size_t i = 0; i < loop.size(); ++i)
        for (std::size_t j = 0; j < island.size(); ++j)
            if (const double d = (vertices[loop[i].from] - vertices[island[j].from]).squaredNorm(); d < nearest) {
                nearest = d;
                at = i;
                other = j;
            }
    RimLoop joined(loop.begin(), loop.begin() + std::ptrdiff_t(at));
    joined.push_back({loop[at].from, island[other].from, Vec3::Zero()});
    joined.insert(joined.end(), island.begin() + std::ptrdiff_t(other), island.end());
    joined.insert(joined.end(), island.begin(), island.begin() + std::ptrdiff_t(other));
    joined.push_back({island[other].from, loop[at].from, Vec3::Zero()});
    joined.insert(joined.end(), loop.begin() + std::ptrdiff_t(at), loop.end());
    loop = std::move(joined);
}

/// Triangulates a polygon by dynamic programming over its chords.
class Triangulation {
  public:
    Triangulation(const std::vector<Vec3>& vertices, const RimLoop& loop) : loop_(loop) {
        for (const RimEdge& e : loop) points_.push_back(vertices[e.from]);
    }

    /// Without overlap in the plane with this normal: every triangle has its front there.
    bool solveFlat(const Vec3& normal, double leastArea) {
        return solve([&](std::size_t i, std::size_t m, std::size_t k) {
            const Vec3 a = points_[m] - points_[i], b = points_[k] - points_[i], c = points_[k] - points_[m];
            if (!(normal.dot(a.cross(b)) > 2 * leastArea)) return kImpossible;
            return a.squaredNorm() + b.squaredNorm() + c.squaredNorm();
        });
    }

    /// With as few and gentle bends as possible, also at the rim.
    bool solveSmooth() {
        return solve([&](std::size_t i, std::size_t m, std::size_t k) {
            const Vec3 n = normalOf(i, m, k);
            if (n.isZero()) return kImpossible;
            double cost = bendAt(i, m, n) + bendAt(m, k, n);
            if (i == 0 && k + 1 == points_.size()) cost += bend(loop_.back().beside, n, k, 0);
            return cost;
        });
    }

    std::vector<Corners> faces() const {
        std::vector<Corners> out;
        collect(0, points_.size() - 1, out);
        return out;
    }

  private:
    std::size_t place(std::size_t i, std::size_t k) const { return i * points_.size() + k; }

    /// cost(i, m, k): of a triangle at the chord from i to k whose other chords are solved.
    template <class Cost>
    bool solve(Cost&& cost) {
        const std::size_t n = points_.size();
        best_.assign(n * n, 0);
        middle_.assign(n * n, 0);
        for (std::size_t length = 2; length < n; ++length)
            for (std::size_t i = 0; i + length < n; ++i) {
                const std::size_t k = i + length;
                double least = kImpossible;
                for (std::size_t m = i + 1; m < k; ++m) {
                    const double before = best_[place(i, m)] + best_[place(m, k)];
                    if (!(before < least)) continue;
                    if (const double c = before + cost(i, m, k); c < least) {
                        least = c;
                        middle_[place(i, k)] = m;
                    }
                }
                best_[place(i, k)] = least;
            }
        return best_[place(0, n - 1)] < kImpossible;
    }

    Vec3 normalOf(std::size_t i, std::size_t m, std::size_t k) const {
        const Triangle t{points_[i], points_[m], points_[k]};
        if (!isUsable(t)) return Vec3::Zero();
        return (t[1] - t[0]).cross(t[2] - t[0]).normalized();
    }

    /// Cost of the bend between a triangle with this normal and what is on the other side of the chord from i to k.
    double bendAt(std::size_t i, std::size_t k, const Vec3& n) const {
        return bend(k == i + 1 ? loop_[i].beside : normalOf(i, middle_[place(i, k)], k), n, i, k);
    }

    double bend(const Vec3& one, const Vec3& other, std::size_t i, std::size_t k) const {
        if (one.isZero()) return 0;
        const double cosine = one.dot(other);
        if (cosine < kFolded) return kImpossible;
        const double sharp = std::min(1 - cosine, kCorner) + 1e-3 * (1 - cosine);
        return sharp * (points_[k] - points_[i]).norm();
    }

    void collect(std::size_t i, std::size_t k, std::vector<Corners>& out) const {
        if (k < i + 2) return;
        const std::size_t m = middle_[place(i, k)];
        out.push_back({loop_[i].from, loop_[m].from, loop_[k].from});
        collect(i, m, out);
        collect(m, k, out);
    }

    const RimLoop& loop_;
    std::vector<Vec3> points_;
    std::vector<double> best_;
    std::vector<std::size_t> middle_;
};

}  // namespace

std::vector<RimLoop> rimLoops(std::vector<RimEdge> edges) {
    std::multimap<int, std::size_t> leaving;
    for (std::size_t i = 0; i < edges.size(); ++i) leaving.emplace(edges[i].from, i);
    std::vector<RimLoop> loops;
    RimLoop path;
    std::map<int, std::size_t> passed;  // by vertex: its place in the path
    while (!leaving.empty()) {
        path.clear();
        passed.clear();
        for (auto next = leaving.begin(); next != leaving.end(); next = leaving.find(path.back().to)) {
            passed[edges[next->second].from] = path.size();
            path.push_back(edges[next->second]);
            leaving.erase(next);
            const auto again = passed.find(path.back().to);
            if (again == passed.end()) continue;
            const auto first = path.begin() + std::ptrdiff_t(again->second);
            loops.emplace_back(first, path.end());
            for (auto e = first; e != path.end(); ++e) passed.erase(e->from);
            path.erase(first, path.end());
            if (path.empty()) break;
        }
    }
    return loops;
}

std::vector<std::vector<RimLoop>> flatHoles(const std::vector<Vec3>& vertices, std::vector<RimLoop> loops) {
    std::vector<Vec3> areas;
    for (const RimLoop& loop : loops) areas.push_back(areaVector(vertices, loop));
    std::vector<std::vector<RimLoop>> holes;
    std::vector<char> used(loops.size(), 0);
    std::vector<std::size_t> largest(loops.size());
    std::iota(largest.begin(), largest.end(), std::size_t{0});
    std::stable_sort(largest.begin(), largest.end(),
                     [&](std::size_t a, std::size_t b) { return areas[a].norm() > areas[b].norm(); });
    for (const std::size_t o : largest) {
        if (used[o]) continue;
        used[o] = 1;
        std::vector<RimLoop> hole{loops[o]};
        const Vec3 normal = areas[o].normalized(), base = vertices[loops[o].front().from];
        const double tolerance = kFlatness * extentOf(vertices, loops[o]);
        if (liesIn(vertices, loops[o], base, normal, tolerance))
            for (const std::size_t i : largest)
                if (!used[i] && areas[i].dot(normal) < 0 && liesIn(vertices, loops[i], base, normal, tolerance) &&
                    surrounds(vertices, loops[o], normal, vertices[loops[i].front().from])) {
                    used[i] = 1;
                    hole.push_back(loops[i]);
                }
        holes.push_back(std::move(hole));
    }
    return holes;
}

std::optional<MeshCap> capOf(const std::vector<Vec3>& vertices, const std::vector<RimLoop>& hole) {
    MeshCap cap;
    RimLoop loop = hole.front();
    const double extent = extentOf(vertices, loop);
    const Vec3 normal = areaVector(vertices, loop).normalized();
    cap.flat = liesIn(vertices, loop, vertices[loop.front().from], normal, kFlatness * extent);
    // Rings become one loop, which is triangulated flat or smoothly.
    for (std::size_t i = 1; i < hole.size(); ++i) bridge(vertices, loop, hole[i]);
    if (loop.size() < 3 || loop.size() > (cap.flat ? kMostFlat : kMostSmooth)) return {};
    Triangulation triangulation(vertices, loop);
    if (!(cap.flat ? triangulation.solveFlat(normal, kThinnestEar * extent * extent) : triangulation.solveSmooth()))
        return {};
    cap.faces = triangulation.faces();

    // How much of the rim continues the surface beside it, and how much folds back onto it.
    std::map<std::pair<int, int>, Vec3> beside;
    double rim = 0, continued = 0, folded = 0;
    cap.level = true;
    for (const RimLoop& each : hole)
        for (const RimEdge& e : each) beside[{e.from, e.to}] = e.beside;
    for (const Corners& face : cap.faces) {
        const Triangle t{vertices[face[0]], vertices[face[1]], vertices[face[2]]};
        const Vec3 n = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
        cap.area += areaOf(t);
        bool level = false;
        for (int k = 0; k < 3; ++k) {
            const auto found = beside.find({face[k], face[(k + 1) % 3]});
            if (found == beside.end()) continue;
            const double length = (t[(k + 1) % 3] - t[k]).norm();
            rim += length;
            if (n.dot(found->second) <= -kLevel) folded += length;
            if (n.dot(found->second) >= kGoesOn) continued += length;
            level = level || n.dot(found->second) >= kLevel;
        }
        cap.level = cap.level && level;
    }
    if (2 * folded > rim) return {};  // two sides of a loose triangle: the cap would be its back, and enclose nothing
    cap.continued = rim > 0 ? continued / rim : 0;
    return cap;
}

}  // namespace touchstone
