#include "haptics/collision/mesh_repair.hpp"

#include <algorithm>
#include <cassert>
#include <map>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <unordered_map>

namespace touchstone {
namespace {

constexpr double kWeld = 1e-6;        // of the diagonal: below any feature, above the rounding of text formats
constexpr double kThinnest = 1e-6;    // mean thickness 2V/A, of the diagonal, below which a shell bounds nothing
constexpr double kSmallHoles = 0.01;  // caps over surface: a tube counts as open up to 50 diameters of length
constexpr double kUsable = 1e-12;     // area over longest side squared: a triangle, not a line

constexpr double kLargest = 1e35, kSmallest = 1e-30;  // mm; floats end at 3e38 and 1e-38, spheres need some room
constexpr const char* kNoSurface = "the mesh has no triangle with an area; check the exported surface";

using Corners = std::array<int, 3>;

double areaOf(const Triangle& t) { return 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm(); }

bool isUsable(const Triangle& t) {
    const double longest2 =
        std::max({(t[1] - t[0]).squaredNorm(), (t[2] - t[1]).squaredNorm(), (t[0] - t[2]).squaredNorm()});
    return areaOf(t) > kUsable * longest2;
}

/// Groups that grow together. The smallest member names the group.
class DisjointSets {
  public:
    explicit DisjointSets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
    int find(int i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(int a, int b) {
        a = find(a);
        b = find(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }

  private:
    std::vector<int> parent_;
};

/// For each vertex the first one within the tolerance. A cell is four tolerances wide, so that most look into one only.
std::vector<int> weldVertices(const std::vector<Vec3>& vertices, const Vec3& origin, double tolerance) {
    const double cell = 4 * tolerance;
    std::unordered_map<std::uint64_t, int> newest;
    newest.reserve(vertices.size());
    std::vector<int> previous(vertices.size(), -1), leader(vertices.size());
    const auto cellOf = [&](double x) { return static_cast<std::uint64_t>(std::clamp(x / cell, 0.0, 2097151.0)); };
    const auto keyOf = [](std::uint64_t x, std::uint64_t y, std::uint64_t z) { return (x << 42) | (y << 21) | z; };
    for (int i = 0; i < static_cast<int>(vertices.size()); ++i) {
        const Vec3 p = vertices[i] - origin;
        std::array<std::uint64_t, 3> from, to;
        for (int a = 0; a < 3; ++a) {
            from[a] = cellOf(p[a] - tolerance);
            to[a] = cellOf(p[a] + tolerance);
        }
        int found = i;
        for (auto x = from[0]; x <= to[0]; ++x)
            for (auto y = from[1]; y <= to[1]; ++y)
                for (auto z = from[2]; z <= to[2]; ++z)
                    if (const auto it = newest.find(keyOf(x, y, z)); it != newest.end())
                        for (int j = it->second; j >= 0; j = previous[j])
                            if ((vertices[j] - vertices[i]).squaredNorm() <= tolerance * tolerance)
                                found = std::min(found, j);
        leader[i] = found;
        if (found == i) {
            const auto [it, fresh] = newest.try_emplace(keyOf(cellOf(p[0]), cellOf(p[1]), cellOf(p[2])), i);
            if (!fresh) {
                previous[i] = it->second;
                it->second = i;
            }
        }
    }
    return leader;
}

/// One use of an edge by a face. `forward`: from the smaller vertex to the larger.
struct EdgeUse {
    int from, to, face;
    bool forward;
};

std::vector<EdgeUse> sortedEdges(const std::vector<Corners>& faces) {
    std::vector<EdgeUse> uses;
    uses.reserve(3 * faces.size());
    for (int f = 0; f < static_cast<int>(faces.size()); ++f)
        for (int k = 0; k < 3; ++k) {
            const int a = faces[f][k], b = faces[f][(k + 1) % 3];
            uses.push_back({std::min(a, b), std::max(a, b), f, a < b});
        }
    std::sort(uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) {
        return std::tie(a.from, a.to, a.face) < std::tie(b.from, b.to, b.face);
    });
    return uses;
}

/// Calls visit(first, last) for each run of uses of one edge.
template <class Visit>
void forEachEdge(const std::vector<EdgeUse>& uses, Visit&& visit) {
    for (std::size_t i = 0; i < uses.size();) {
        std::size_t j = i;
        while (j < uses.size() && uses[j].from == uses[i].from && uses[j].to == uses[i].to) ++j;
        visit(uses.data() + i, uses.data() + j);
        i = j;
    }
}

/// Faces cut into shells, and the work of turning and closing them.
class Shells {
  public:
    Shells(std::vector<Vec3> vertices, std::vector<Corners> faces)
        : vertices_(std::move(vertices)), faces_(std::move(faces)) {
        orientConsistently();
        classify();
        nest();
    }

    int holes() const { return holes_; }
    bool single() const { return shells_.size() == 1; }

    void append(std::vector<Face>& out) const {
        for (const Shell& s : shells_) {
            for (int f : s.faces) out.push_back({triangle(f), s.closed ? FaceRole::Wall : FaceRole::Sheet, !s.closed});
            for (const Triangle& cap : s.caps) out.push_back({cap, FaceRole::Cap, false});
        }
    }

  private:
    struct Shell {
        std::vector<int> faces;
        std::vector<Triangle> caps;
        bool closed = false;
        double volume = 0;  ///< signed, as the faces came in
        Box box;
    };

    Triangle triangle(int f) const {
        return {vertices_[faces_[f][0]], vertices_[faces_[f][1]], vertices_[faces_[f][2]]};
    }
    // The common case, told without counting: two faces of one shell that agree.
    bool cancels(const EdgeUse* first, const EdgeUse* last) const {
        return last - first == 2 && shellOf_[first[0].face] == shellOf_[first[1].face] &&
               first[0].forward != first[1].forward;
    }
    void flip(int f) { std::swap(faces_[f][1], faces_[f][2]); }

    // Spreads the sense of the first face over edges with exactly two faces; then turns the shell to the sense of most.
    void orientConsistently() {
        const std::vector<EdgeUse> uses = sortedEdges(faces_);
        std::vector<std::vector<std::pair<int, bool>>> neighbours(faces_.size());
        forEachEdge(uses, [&](const EdgeUse* first, const EdgeUse* last) {
            if (last - first != 2 || first[0].face == first[1].face) return;
            const bool opposed = first[0].forward == first[1].forward;
            neighbours[first[0].face].emplace_back(first[1].face, opposed);
            neighbours[first[1].face].emplace_back(first[0].face, opposed);
        });
        shellOf_.assign(faces_.size(), -1);
        std::vector<char> turned(faces_.size(), 0);
        for (int seed = 0; seed < static_cast<int>(faces_.size()); ++seed) {
            if (shellOf_[seed] >= 0) continue;
            std::vector<int> members{seed};
            shellOf_[seed] = shellCount_;
            for (std::size_t i = 0; i < members.size(); ++i)
                for (const auto& [other, opposed] : neighbours[members[i]])
                    if (shellOf_[other] < 0) {
                        shellOf_[other] = shellCount_;
                        turned[other] = static_cast<char>(turned[members[i]] != static_cast<char>(opposed));
                        members.push_back(other);
                    }
            const auto minority = std::count_if(members.begin(), members.end(), [&](int f) { return turned[f] != 0; });
            const bool most = 2 * minority > static_cast<std::ptrdiff_t>(members.size());
            for (int f : members)
                if ((turned[f] != 0) != most) flip(f);
            ++shellCount_;
        }
    }

    // A shell is closed when the uses of each edge cancel. Open ones that share an edge of many faces get another
    // chance together; then small holes are closed by a cone over each piece of boundary.
    void classify() {
        const std::vector<EdgeUse> uses = sortedEdges(faces_);
        std::vector<char> open(shellCount_, 0);
        const auto markOpen = [&](DisjointSets& groups) {
            std::fill(open.begin(), open.end(), 0);
            forEachEdge(uses, [&](const EdgeUse* first, const EdgeUse* last) {
                if (cancels(first, last)) return;
                std::map<int, int> net;
                for (const EdgeUse* u = first; u != last; ++u)
                    net[groups.find(shellOf_[u->face])] += u->forward ? 1 : -1;
                for (const auto& [group, sum] : net)
                    if (sum != 0) open[group] = 1;
            });
        };
        DisjointSets groups(shellCount_);
        markOpen(groups);
        forEachEdge(uses, [&](const EdgeUse* first, const EdgeUse* last) {
            int before = -1;
            for (const EdgeUse* u = first; u != last; ++u) {
                const int s = shellOf_[u->face];
                if (!open[s]) continue;
                if (before >= 0) groups.join(before, s);
                before = s;
            }
        });
        markOpen(groups);

        std::vector<int> place(shellCount_, -1);
        for (int f = 0; f < static_cast<int>(faces_.size()); ++f) {
            const int group = shellOf_[f] = groups.find(shellOf_[f]);
            if (place[group] < 0) {
                place[group] = static_cast<int>(shells_.size());
                shells_.emplace_back();
                shells_.back().closed = !open[group];
            }
            shells_[place[group]].faces.push_back(f);
        }
        std::vector<std::vector<EdgeUse>> boundaries(shells_.size());
        forEachEdge(uses, [&](const EdgeUse* first, const EdgeUse* last) {
            if (cancels(first, last)) return;
            std::map<int, int> net;
            for (const EdgeUse* u = first; u != last; ++u) net[place[shellOf_[u->face]]] += u->forward ? 1 : -1;
            for (const auto& [s, sum] : net)
                for (int k = 0; k < std::abs(sum); ++k) boundaries[s].push_back({first->from, first->to, -1, sum > 0});
        });
        for (std::size_t s = 0; s < shells_.size(); ++s) measure(shells_[s], boundaries[s]);
    }

    void measure(Shell& shell, const std::vector<EdgeUse>& boundary) {
        double area = 0;
        for (int f : shell.faces) {
            area += areaOf(triangle(f));
            for (const Vec3& v : triangle(f)) shell.box.add(v);
        }
        int rims = 0;
        if (!shell.closed) shell.caps = cones(boundary, rims);
        double capArea = 0;
        for (const Triangle& t : shell.caps) capArea += areaOf(t);
        if (capArea > kSmallHoles * area) shell.caps.clear();

        const Vec3 base = shell.box.center();  // any point will do; a near one keeps the digits
        const auto tetrahedron = [&](const Triangle& t) {
            return (t[0] - base).dot((t[1] - base).cross(t[2] - base)) / 6;
        };
        for (int f : shell.faces) shell.volume += tetrahedron(triangle(f));
        for (const Triangle& t : shell.caps) shell.volume += tetrahedron(t);
        const bool bounds = shell.closed || !shell.caps.empty();
        const bool thick = 2 * std::abs(shell.volume) > kThinnest * area;
        if (bounds && thick && !shell.closed) holes_ += rims;
        shell.closed = bounds && thick;
        if (!shell.closed) shell.caps.clear();
    }

    // One cone per connected piece of boundary, from its centroid. Its rim runs against the boundary, so all edges
    // cancel.
    std::vector<Triangle> cones(const std::vector<EdgeUse>& boundary, int& rims) const {
        std::map<int, int> local;
        for (const EdgeUse& u : boundary) {
            local.try_emplace(u.from, static_cast<int>(local.size()));
            local.try_emplace(u.to, static_cast<int>(local.size()));
        }
        DisjointSets pieces(local.size());
        for (const EdgeUse& u : boundary) pieces.join(local[u.from], local[u.to]);
        std::vector<Vec3> sum(local.size(), Vec3::Zero());
        std::vector<int> count(local.size(), 0);
        for (const auto& [vertex, l] : local) {
            sum[pieces.find(l)] += vertices_[vertex];
            ++count[pieces.find(l)];
        }
        rims = static_cast<int>(std::count_if(count.begin(), count.end(), [](int n) { return n > 0; }));
        std::vector<Triangle> caps;
        for (const EdgeUse& u : boundary) {
            const int piece = pieces.find(local[u.from]);
            const Vec3 apex = sum[piece] / count[piece];
            const Vec3 &a = vertices_[u.from], &b = vertices_[u.to];
            caps.push_back(u.forward ? Triangle{b, a, apex} : Triangle{a, b, apex});
        }
        return caps;
    }

    void turn(Shell& shell) {
        for (int f : shell.faces) flip(f);
        for (Triangle& t : shell.caps) std::swap(t[1], t[2]);
    }

    // All closed shells are turned outward; those wholly inside another that came with the opposite sense, inward
    // again.
    void nest() {
        std::vector<int> closed;
        for (int s = 0; s < static_cast<int>(shells_.size()); ++s)
            if (shells_[s].closed) closed.push_back(s);
        for (int s : closed)
            if (shells_[s].volume < 0) turn(shells_[s]);
        std::sort(closed.begin(), closed.end(), [&](int a, int b) {
            const double va = std::abs(shells_[a].volume), vb = std::abs(shells_[b].volume);
            return va > vb || (va == vb && a < b);
        });
        std::map<int, TriangleBvh> fields;
        const auto inside = [&](int inner, int outer) {
            const Box &a = shells_[inner].box, &b = shells_[outer].box;
            if (!((a.lo.array() > b.lo.array()).all() && (a.hi.array() < b.hi.array()).all())) return false;
            auto it = fields.find(outer);
            if (it == fields.end()) {
                std::vector<Triangle> all = shells_[outer].caps;
                for (int f : shells_[outer].faces) all.push_back(triangle(f));
                it = fields.emplace(outer, TriangleBvh(std::move(all))).first;
            }
            return std::all_of(shells_[inner].faces.begin(), shells_[inner].faces.end(),
                               [&](int f) { return it->second.windingNumber(vertices_[faces_[f][0]]) >= 0.5; });
        };
        const auto turnedIn = [&](int s) { return shells_[s].volume < 0; };
        if (std::all_of(closed.begin(), closed.end(), turnedIn) || std::none_of(closed.begin(), closed.end(), turnedIn))
            return;
        std::vector<int> cavities;
        for (std::size_t i = 1; i < closed.size(); ++i) {
            // The largest container decides; it is found first.
            for (std::size_t j = 0; j < i; ++j) {
                if (!inside(closed[i], closed[j])) continue;
                if (turnedIn(closed[i]) != turnedIn(closed[j])) cavities.push_back(closed[i]);
                break;
            }
        }
        for (int s : cavities) turn(shells_[s]);
    }

    std::vector<Vec3> vertices_;
    std::vector<Corners> faces_;
    std::vector<int> shellOf_;
    std::vector<Shell> shells_;
    int shellCount_ = 0;
    int holes_ = 0;
};

/// One copy of each face: same-sense copies collapse; equally many of both senses bound nothing and are set apart.
void removeDuplicates(std::vector<Corners>& faces, std::vector<Corners>& cancelled) {
    struct Keyed {
        Corners key;
        int face;
        bool even;
    };
    std::vector<Keyed> keyed;
    keyed.reserve(faces.size());
    for (int f = 0; f < static_cast<int>(faces.size()); ++f) {
        Corners key = faces[f];
        std::rotate(key.begin(), std::min_element(key.begin(), key.end()), key.end());
        const bool even = key[1] < key[2];
        if (!even) std::swap(key[1], key[2]);
        keyed.push_back({key, f, even});
    }
    std::sort(keyed.begin(), keyed.end(),
              [](const Keyed& a, const Keyed& b) { return std::tie(a.key, a.face) < std::tie(b.key, b.face); });
    std::vector<char> keep(faces.size(), 0);
    for (std::size_t i = 0; i < keyed.size();) {
        std::size_t j = i;
        int net = 0;
        for (; j < keyed.size() && keyed[j].key == keyed[i].key; ++j) net += keyed[j].even ? 1 : -1;
        if (net == 0) cancelled.push_back(faces[keyed[i].face]);
        for (std::size_t k = i; k < j && net != 0; ++k)
            if (keyed[k].even == (net > 0)) {
                keep[keyed[k].face] = 1;
                break;
            }
        i = j;
    }
    std::vector<Corners> kept;
    for (std::size_t f = 0; f < faces.size(); ++f)
        if (keep[f]) kept.push_back(faces[f]);
    faces = std::move(kept);
}

/// Whether the segment meets the triangle, or nearly: doubts count as yes.
bool nearlyMeets(const Vec3& p, const Vec3& q, const Triangle& t) {
    const Vec3 n = (t[1] - t[0]).cross(t[2] - t[0]);
    const double slack = 1e-9 * n.norm();
    const double sp = n.dot(p - t[0]), sq = n.dot(q - t[0]);
    if ((sp > slack && sq > slack) || (sp < -slack && sq < -slack)) return false;
    const Vec3 x = std::abs(sp - sq) > 0 ? Vec3(p + sp / (sp - sq) * (q - p)) : p;
    const double reach = std::abs(sp - sq) > 2 * slack ? 1e-9 : (q - p).norm();  // nearly parallel: a generous net
    return (closestPoint(x, t, !isUsable(t)) - x).norm() <= reach;
}

bool mayCross(const Triangle& a, const Triangle& b) {
    const auto shared = [](const Vec3& v, const Triangle& t) { return v == t[0] || v == t[1] || v == t[2]; };
    const auto pierces = [&](const Triangle& s, const Triangle& t) {
        for (int k = 0; k < 3; ++k) {
            const Vec3 &p = s[k], &q = s[(k + 1) % 3];
            if (!shared(p, t) && !shared(q, t) && nearlyMeets(p, q, t)) return true;
        }
        return false;
    };
    return pierces(a, b) || pierces(b, a);
}

/// Marks what lies inside. The winding number is constant over each side of a face that no other crosses, so one probe
/// a hair off either side of its centroid decides.
void markBuried(std::vector<Face>& faces) {
    std::vector<Triangle> walls;
    for (const Face& f : faces)
        if (f.role == FaceRole::Wall || f.role == FaceRole::Cap) walls.push_back(f.corners);
    if (walls.empty()) return;
    const TriangleBvh field(walls);
    for (Face& f : faces) {
        if (f.role == FaceRole::Cap) continue;
        const auto& [a, b, c] = f.corners;
        const Vec3 centroid = (a + b + c) / 3;
        const Vec3 probe = 1e-9 * (b - a).cross(c - a).normalized();
        const bool inside =
            field.windingNumber(centroid + probe) >= 0.5 && field.windingNumber(centroid - probe) >= 0.5;
        if (!inside) continue;
        if (f.role == FaceRole::Sheet) {
            f.exposed = false;
            continue;
        }
        Box box;
        for (const Vec3& v : f.corners) box.add(v);
        bool crossed = !isUsable(f.corners);
        field.overlapping(box, [&](int other) { crossed = crossed || mayCross(f.corners, walls[other]); });
        if (!crossed) f.role = FaceRole::Buried;
    }
}

}  // namespace

bool RepairedMesh::closed() const {
    return holes == 0 && std::none_of(faces.begin(), faces.end(), [](const Face& f) { return f.exposed; });
}

RepairedMesh repairMesh(const TriangleMesh& mesh) {
    RepairedMesh out;
    double largest = 0;
    for (const Vec3& v : mesh.vertices) largest = std::max(largest, v.cwiseAbs().maxCoeff());
    if (largest > kLargest)
        throw std::invalid_argument("the mesh has coordinates too large for single precision; scale it down");

    Box box;
    for (const auto& t : mesh.triangles)
        for (std::uint32_t i : t) {
            assert(i < mesh.vertices.size());
            box.add(mesh.vertices[i]);
        }
    const Vec3 size = box.hi - box.lo;
    const double extent = mesh.triangles.empty() ? 0 : size.maxCoeff();  // the square of the diagonal might underflow
    if (!(extent > 0)) throw std::invalid_argument(kNoSurface);
    if (extent < kSmallest) throw std::invalid_argument("the mesh is too small for single precision; scale it up");
    int exponent = 0;
    std::frexp(extent * (size / extent).norm(), &exponent);
    out.scale = std::ldexp(1.0, 1 - exponent);
    out.diagonal = extent * (size / extent).norm() * out.scale;

    std::vector<Vec3> vertices;
    vertices.reserve(mesh.vertices.size());
    for (const Vec3& v : mesh.vertices) vertices.push_back(v * out.scale);
    const std::vector<int> leader = weldVertices(vertices, box.lo * out.scale, kWeld * out.diagonal);
    std::vector<Corners> faces;
    for (const auto& t : mesh.triangles) {
        const Triangle corners{vertices[t[0]], vertices[t[1]], vertices[t[2]]};
        const bool usable = isUsable(corners);
        if (usable) out.cover.push_back(corners);
        const Corners welded{leader[t[0]], leader[t[1]], leader[t[2]]};
        if (welded[0] == welded[1] || welded[1] == welded[2] || welded[2] == welded[0]) {
            if (usable) out.faces.push_back({corners, FaceRole::Sheet, false});  // a crumb: covered, but spoils nothing
            continue;
        }
        faces.push_back(welded);
        for (std::uint32_t i : t) out.weld = std::max(out.weld, (vertices[i] - vertices[leader[i]]).norm());
    }
    if (out.cover.empty()) throw std::invalid_argument(kNoSurface);

    std::vector<Corners> cancelled;
    removeDuplicates(faces, cancelled);
    for (const Corners& c : cancelled)
        out.faces.push_back({{vertices[c[0]], vertices[c[1]], vertices[c[2]]}, FaceRole::Sheet, true});
    const Shells shells(std::move(vertices), std::move(faces));
    out.holes = shells.holes();
    shells.append(out.faces);
    // A line of no area that bounds nothing is no surface.
    std::erase_if(out.faces, [](const Face& f) { return f.role == FaceRole::Sheet && !isUsable(f.corners); });
    if (!shells.single() || !cancelled.empty()) markBuried(out.faces);
    return out;
}

}  // namespace touchstone
