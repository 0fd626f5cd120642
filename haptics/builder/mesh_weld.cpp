#include "haptics/builder/mesh_weld.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <tuple>

namespace touchstone {
namespace {

constexpr int kBucket = 8;  // maximum number of points in a bucket, which a search tests one by one
/// Maximum number of rounds in which open edges are joined. Each may move the surface by another twice the tolerance.
constexpr int kSeamRounds = 4;

Triangle triangleOf(const std::vector<Vec3>& vertices, const Corners& c) {
    return {vertices[c[0]], vertices[c[1]], vertices[c[2]]};
}

bool collapsed(const Corners& c) { return c[0] == c[1] || c[1] == c[2] || c[2] == c[0]; }

/// Merges points: each point is replaced by the first earlier place within the tolerance, or becomes a new place.
class Places {
  public:
    Places(std::size_t most, const Vec3& origin, double tolerance)
        : newest_(std::bit_ceil(most + 1), -1), origin_(origin), tolerance_(tolerance) {}

    int add(const Vec3& p) {
        // Cells are four tolerances wide, so that most points need to search only one cell.
        std::array<std::int64_t, 3> from, to;
        for (int a = 0; a < 3; ++a) {
            from[a] = cellOf(p[a] - origin_[a] - tolerance_);
            to[a] = cellOf(p[a] - origin_[a] + tolerance_);
        }
        const int fresh = static_cast<int>(points.size());
        int found = fresh;
        for (auto x = from[0]; x <= to[0]; ++x)
            for (auto y = from[1]; y <= to[1]; ++y)
                for (auto z = from[2]; z <= to[2]; ++z)
                    for (int j = newest_[slotOf(x, y, z)]; j >= 0; j = previous_[j])
                        if ((points[j] - p).squaredNorm() <= tolerance_ * tolerance_) found = std::min(found, j);
        if (found == fresh) {
            int& newest =
                newest_[slotOf(cellOf(p[0] - origin_[0]), cellOf(p[1] - origin_[1]), cellOf(p[2] - origin_[2]))];
            points.push_back(p);
            previous_.push_back(newest);
            newest = fresh;
        }
        return found;
    }

    std::vector<Vec3> points;

  private:
    std::int64_t cellOf(double x) const { return static_cast<std::int64_t>(std::floor(x / (4 * tolerance_))); }
    // Several cells may share a slot. This is harmless, because the distance decides.
    std::size_t slotOf(std::int64_t x, std::int64_t y, std::int64_t z) const {
        std::uint64_t hash = 0;
        for (const std::int64_t c : {x, y, z}) {
            hash = (hash ^ static_cast<std::uint64_t>(c)) * 0x9E3779B97F4A7C15u;
            hash ^= hash >> 32;
        }
        return hash & (newest_.size() - 1);
    }

    std::vector<int> newest_, previous_;
    Vec3 origin_;
    double tolerance_;
};

/// Whether a face is missing at an edge: one that bounds a volume has a face on each side, or several.
bool isOpen(const EdgeTable::Edge& e) { return e.uses.size() % 2 == 1; }

/// Decides on faces that came in both orientations. A patch of them is a wall, drawn from both sides or with copies
/// turned over, if it closes more edges than it opens, or is closed itself: then it is moved to the faces. Otherwise it
/// is a membrane.
void placeTwoSided(WeldedMesh& mesh, const std::vector<Corners>& twoSided, Pulse& pulse) {
    if (twoSided.empty()) return;
    const int first = int(mesh.faces.size());
    std::vector<Corners> all = mesh.faces;
    all.insert(all.end(), twoSided.begin(), twoSided.end());
    const EdgeTable edges(all, mesh.vertices.size(), pulse);
    DisjointSets patches(twoSided.size());
    const auto forEachUse = [&](const EdgeTable::Edge& e, auto&& visit) {
        for (const int use : e.uses)
            if (use / 3 >= first) visit(use / 3 - first);
    };
    edges.forEach([&](const EdgeTable::Edge& e) {
        int before = -1;
        forEachUse(e, [&](int f) {
            if (before >= 0) patches.join(before, f);
            before = f;
        });
    });
    struct Rim {
        int closed = 0, opened = 0;  ///< edges of the faces that the patch closes, opens
        int loose = 0;               ///< edges of the patch alone: its neighbor may have a vertex there
    };
    std::vector<Rim> rims(twoSided.size());
    edges.forEach([&](const EdgeTable::Edge& e) {
        int ours = 0, patch = -1;
        forEachUse(e, [&](int f) { ++ours, patch = patches.find(f); });
        if (ours % 2 == 1)
            ++(ours == int(e.uses.size()) ? rims[patch].loose : isOpen(e) ? rims[patch].opened : rims[patch].closed);
    });
    for (int f = 0; f < int(twoSided.size()); ++f) {
        const Rim& rim = rims[patches.find(f)];
        const bool wall = rim.closed > rim.opened || rim.closed + rim.opened + rim.loose == 0;
        (wall ? mesh.faces : mesh.membranes).push_back(twoSided[f]);
        mesh.repairs.duplicates += wall;
    }
}

/// Keeps one copy of each face. Copies of equal orientation collapse; placeTwoSided() decides where both orientations
/// are equally frequent.
void removeDuplicates(WeldedMesh& mesh, Pulse& pulse) {
    std::vector<Corners>& faces = mesh.faces;
    struct Sides {
        int second, third;  // in rising order
        bool even;
    };
    const auto sidesOf = [&](int f) {
        const Corners& c = faces[f];
        const auto least = std::min_element(c.begin(), c.end()) - c.begin();
        const int x = c[(least + 1) % 3], y = c[(least + 2) % 3];
        return Sides{std::min(x, y), std::max(x, y), x < y};
    };
    Grouped byLeast(faces.size(), mesh.vertices.size(),
                    [&](int f) { return *std::min_element(faces[f].begin(), faces[f].end()); });
    std::vector<char> keep(faces.size(), 0);
    std::vector<Corners> twoSided;
    for (int v = 0; v < byLeast.groups(); ++v) {
        pulse();
        const std::span<int> group = byLeast[v];
        std::sort(group.begin(), group.end(), [&](int f, int g) {
            const Sides a = sidesOf(f), b = sidesOf(g);
            return std::tie(a.second, a.third, f) < std::tie(b.second, b.third, g);
        });
        for (std::size_t i = 0, j = 0; i < group.size(); i = j) {
            const Sides first = sidesOf(group[i]);
            int net = 0;
            for (; j < group.size(); ++j) {
                const Sides s = sidesOf(group[j]);
                if (s.second != first.second || s.third != first.third) break;
                net += s.even ? 1 : -1;
            }
            if (net == 0) twoSided.push_back(faces[group[i]]);
            mesh.repairs.duplicates += int(j - i) - (net == 0 ? 2 : 1);
            for (std::size_t k = i; k < j && net != 0; ++k)
                if (sidesOf(group[k]).even == (net > 0)) {
                    keep[group[k]] = 1;
                    break;
                }
        }
    }
    std::size_t kept = 0;
    for (std::size_t f = 0; f < faces.size(); ++f)
        if (keep[f]) faces[kept++] = faces[f];
    faces.resize(kept);
    placeTwoSided(mesh, twoSided, pulse);
}

/// Finds points near a segment. A k-d tree without nodes: it consists only of the order of the points.
class PointsNearSegment {
  public:
    PointsNearSegment(const std::vector<Vec3>& all, const std::vector<char>& chosen, Pulse& pulse) {
        for (std::size_t i = 0; i < all.size(); ++i)
            if (chosen[i]) points_.push_back({all[i], static_cast<int>(i)});
        sort(0, points_.size(), 0, pulse);
    }
    bool empty() const { return points_.empty(); }

    /// Calls visit(index, point) for all points within `reach` of a + t d, t in [0, 1], and for some others.
    template <class Visit>
    void visit(const Vec3& a, const Vec3& d, double reach, Visit&& visit) const {
        descend(0, points_.size(), 0, a, d, reach, 0, 1, visit);
    }

  private:
    struct Point {
        Vec3 at;
        int index;
    };

    void sort(std::size_t first, std::size_t last, int axis, Pulse& pulse) {
        if (last - first <= kBucket) return;
        pulse();
        const std::size_t middle = first + (last - first) / 2;
        const auto at = [&](std::size_t i) { return points_.begin() + static_cast<std::ptrdiff_t>(i); };
        std::nth_element(at(first), at(middle), at(last), [&](const Point& a, const Point& b) {
            return a.at[axis] < b.at[axis] || (a.at[axis] == b.at[axis] && a.index < b.index);
        });
        sort(first, middle, (axis + 1) % 3, pulse);
        sort(middle + 1, last, (axis + 1) % 3, pulse);
    }

    // [from, to] is the part of the segment that comes within reach of this half-space. Each side of the cut receives
    // the part that comes within reach of it.
    template <class Visit>
    void descend(std::size_t first, std::size_t last, int axis, const Vec3& a, const Vec3& d, double reach, double from,
                 double to, Visit&& visit) const {
        if (last - first <= kBucket) {
            for (std::size_t i = first; i < last; ++i) visit(points_[i].index, points_[i].at);
            return;
        }
        const std::size_t middle = first + (last - first) / 2;
        const double cut = points_[middle].at[axis] - a[axis], along = d[axis];
        const int next = (axis + 1) % 3;
        // The range of t in which a + t d is at most `reach` above the cut, and the range in which it is at most
        // `reach` below.
        double below[2] = {from, to}, above[2] = {from, to};
        if (along > 0) {
            below[1] = std::min(to, (cut + reach) / along);
            above[0] = std::max(from, (cut - reach) / along);
        } else if (along < 0) {
            below[0] = std::max(from, (cut + reach) / along);
            above[1] = std::min(to, (cut - reach) / along);
        } else {
            if (cut + reach < 0) below[1] = -1;
            if (cut - reach > 0) above[1] = -1;
        }
        visit(points_[middle].index, points_[middle].at);
        if (below[0] <= below[1]) descend(first, middle, next, a, d, reach, below[0], below[1], visit);
        if (above[0] <= above[1]) descend(middle + 1, last, next, a, d, reach, above[0], above[1], visit);
    }

    std::vector<Point> points_;
};

/// Cuts a face into triangles with the given vertices on its sides. Each list is ordered along its side.
void split(const Corners& face, const std::array<std::span<const int>, 3>& on, std::vector<Corners>& out) {
    for (std::size_t k = 0; k < 3; ++k) {
        if (on[k].empty()) continue;
        const int a = face[k], b = face[(k + 1) % 3], c = face[(k + 2) % 3];
        split({a, on[k].front(), c}, {{{}, {}, on[(k + 2) % 3]}}, out);
        for (std::size_t i = 0; i + 1 < on[k].size(); ++i) split({on[k][i], on[k][i + 1], c}, {}, out);
        split({on[k].back(), b, c}, {{{}, on[(k + 1) % 3], {}}}, out);
        return;
    }
    if (!collapsed(face)) out.push_back(face);
}

/// By vertex: whether it is an end of an open edge.
std::vector<char> rimOf(const WeldedMesh& mesh, const EdgeTable& edges) {
    std::vector<char> onRim(mesh.vertices.size(), 0);
    edges.forEach([&](const EdgeTable::Edge& e) {
        if (isOpen(e)) onRim[e.low] = onRim[e.high] = 1;
    });
    return onRim;
}

/// Joins the ends of open edges within the tolerance, and drops faces that collapse. Returns whether any was joined.
bool joinRims(WeldedMesh& mesh, const Vec3& origin, double tolerance, Pulse& pulse) {
    const std::vector<char> onRim = rimOf(mesh, EdgeTable(mesh.faces, mesh.vertices.size(), pulse));
    Places places(std::size_t(std::count(onRim.begin(), onRim.end(), 1)), origin, tolerance);
    std::vector<int> first, to(mesh.vertices.size());
    std::iota(to.begin(), to.end(), 0);
    double farthest = 0;
    int joined = 0;
    for (std::size_t v = 0; v < onRim.size(); ++v) {
        if (!onRim[v]) continue;
        pulse();
        const auto place = std::size_t(places.add(mesh.vertices[v]));
        if (place == first.size()) {
            first.push_back(int(v));
            continue;
        }
        to[v] = first[place];
        ++joined;
        farthest = std::max(farthest, (places.points[place] - mesh.vertices[v]).norm());
    }
    if (joined == 0) return false;
    mesh.moved += farthest;
    mesh.repairs.joined += joined;
    std::erase_if(mesh.faces, [&](Corners& face) {
        for (int& corner : face) corner = to[corner];
        return collapsed(face);
    });
    for (int& place : mesh.placeOf)
        if (place >= 0) place = to[place];
    return true;
}

/// Splits faces at vertices that lie on their open edges. Returns whether there were any. Adds the largest distance of
/// such a vertex from its edge to `moved`.
bool splitAtSeams(WeldedMesh& mesh, double tolerance, Pulse& pulse) {
    struct Junction {
        int use;
        double along;
        int vertex;
    };
    // Find vertices of the rim that lie on an open edge.
    std::vector<Junction> junctions;
    double farthest = 0;
    {
        const EdgeTable edges(mesh.faces, mesh.vertices.size(), pulse);
        const PointsNearSegment points(mesh.vertices, rimOf(mesh, edges), pulse);
        if (points.empty()) return false;
        edges.forEach([&](const EdgeTable::Edge& e) {
            if (!isOpen(e)) return;
            pulse();
            for (const int use : e.uses) {
                const Vec3 a = mesh.vertices[edges.from(use)], d = mesh.vertices[edges.to(use)] - a;
                const Corners& face = mesh.faces[use / 3];
                points.visit(a, d, tolerance, [&](int v, const Vec3& point) {
                    const Vec3 p = point - a;
                    const double t = p.dot(d) / d.squaredNorm(), off = (p - t * d).norm();
                    if (!(t > 0 && t < 1 && off <= tolerance) || v == face[0] || v == face[1] || v == face[2]) return;
                    junctions.push_back({use, t, v});
                    farthest = std::max(farthest, off);
                });
            }
        });
    }
    if (junctions.empty()) return false;
    mesh.moved += farthest;
    mesh.repairs.stitched += int(junctions.size());
    std::sort(junctions.begin(), junctions.end(), [](const Junction& a, const Junction& b) {
        return std::tie(a.use, a.along, a.vertex) < std::tie(b.use, b.along, b.vertex);
    });
    // Split each face at those on its three edges, in the order along the edge.
    std::vector<int> vertices;
    for (const Junction& j : junctions) vertices.push_back(j.vertex);
    std::vector<Corners> faces;
    std::size_t next = 0;
    for (int f = 0; f < static_cast<int>(mesh.faces.size()); ++f) {
        std::array<std::span<const int>, 3> on;
        for (int k = 0; k < 3; ++k) {
            const std::size_t first = next;
            while (next < junctions.size() && junctions[next].use == 3 * f + k) ++next;
            on[k] = {vertices.data() + first, next - first};
        }
        split(mesh.faces[f], on, faces);
    }
    mesh.faces = std::move(faces);
    return true;
}

/// Drops what is thinner than twice the tolerance and bounds nothing: faces with another face too few or too many at
/// each side, which are left over where two faces met across them, and membranes.
void dropSlivers(WeldedMesh& mesh, double tolerance, Pulse& pulse) {
    std::vector<int> openSides(mesh.faces.size(), 0);
    EdgeTable(mesh.faces, mesh.vertices.size(), pulse).forEach([&](const EdgeTable::Edge& e) {
        if (isOpen(e))
            for (const int use : e.uses) ++openSides[use / 3];
    });
    const auto isThin = [&](const Corners& face) {
        return altitudeOf(triangleOf(mesh.vertices, face)) <= 2 * tolerance;  // each side may have moved by it
    };
    std::size_t f = 0;
    mesh.repairs.degenerate +=
        int(std::erase_if(mesh.faces, [&](const Corners& face) { return openSides[f++] == 3 && isThin(face); }) +
            std::erase_if(mesh.membranes, isThin));
}

}  // namespace

WeldedMesh weldMesh(const TriangleMesh& mesh, double scale, const Box& box, const WeldTolerance& tolerance,
                    Pulse& pulse) {
    WeldedMesh out;
    std::vector<int>& placeOf = out.placeOf;
    placeOf.assign(mesh.vertices.size(), -1);
    for (const auto& t : mesh.triangles)
        for (const std::uint32_t i : t) placeOf[i] = 0;
    const auto used = static_cast<std::size_t>(std::count(placeOf.begin(), placeOf.end(), 0));
    Places places(used, box.lo, tolerance.all);
    for (std::size_t i = 0; i < placeOf.size(); ++i) {
        pulse();
        if (placeOf[i] != 0) continue;
        const Vec3 p = mesh.vertices[i] * scale;
        placeOf[i] = places.add(p);
        out.repairs.joined += places.points[std::size_t(placeOf[i])] != p;
    }
    out.vertices = std::move(places.points);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        pulse();
        const auto& t = mesh.triangles[i];
        const Triangle original{mesh.vertices[t[0]] * scale, mesh.vertices[t[1]] * scale, mesh.vertices[t[2]] * scale};
        const Corners corners{placeOf[t[0]], placeOf[t[1]], placeOf[t[2]]};
        const Triangle welded = triangleOf(out.vertices, corners);
        if (collapsed(corners) || !isUsable(welded)) {
            ++out.repairs.degenerate;
            if (isUsable(original)) out.crumbs.push_back(static_cast<int>(i));
            continue;
        }
        out.faces.push_back(corners);
        for (int k = 0; k < 3; ++k) out.moved = std::max(out.moved, (original[k] - welded[k]).norm());
    }
    removeDuplicates(out, pulse);
    if (splitAtSeams(out, tolerance.all, pulse)) removeDuplicates(out, pulse);
    // A vertex that is joined or set into an edge may make the next one meet its neighbor.
    for (int round = 0; round < kSeamRounds && tolerance.open > tolerance.all; ++round) {
        const bool joined = joinRims(out, box.lo, tolerance.open, pulse);
        if (!splitAtSeams(out, tolerance.open, pulse) && !joined) break;
        removeDuplicates(out, pulse);
        dropSlivers(out, tolerance.open, pulse);
    }
    return out;
}

}  // namespace touchstone
