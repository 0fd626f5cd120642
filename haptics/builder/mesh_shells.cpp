#include "haptics/builder/mesh_shells.hpp"

#include <cmath>
#include <map>
#include <tuple>

#include "haptics/builder/box_search.hpp"
#include "haptics/builder/mesh_caps.hpp"
#include "haptics/builder/mesh_tidy.hpp"
#include "haptics/builder/wall_crossings.hpp"

namespace touchstone {
namespace {

// Mean thickness 2V/A, in the frame of RepairedMesh, below which a shell bounds no volume.
constexpr double kThinnest = 1e-6;
// Largest ratio of the caps' area to the surface's area: so that a tube of up to 50 diameters in length stays open.
constexpr double kSmallHoles = 0.01;
// Largest caps that close a hole for sure, as shares of the area of the closed shell. Flat and going on with the
// surface beside it: a plate of twelve triangles may lack one, a quarter. Smooth: a guess, so less. A flat opening:
// more might be meant to be open, as a box without a lid is.
constexpr double kFlatCap = 0.25, kSmoothCap = 0.05, kOpening = 0.1;
// Least share of the rim where a cap continues the surface: a triangle of a box does along its diagonal.
constexpr double kFlatRim = 0.25, kSmoothRim = 0.5;
// Least ratio of a loose sheet's vector area to its area: a flat one has 1, half a sphere 0.5.
constexpr double kNearlyFlat = 0.7;
// Largest area of loose sheets attached to the closed shells, as a share of the shells' area: a larger one may be a
// fin.
constexpr double kFlaps = 0.01;
// Maximum number of rounds in which flaps are dropped.
constexpr int kFlapRounds = 100;
// Thickness above which a part of a shell that is inside out counts, in the frame of RepairedMesh and as a multiple of
// what rounding can part: the larger one. With smaller ones folds of rounding would make a body a sheet; with larger
// ones nothing is felt of thicker parts.
constexpr double kThinnestLobe = 1e-4, kThinnestRounded = 2;
// Number of winding numbers that are summed directly. Beyond it, building a tree for them pays off.
constexpr int kDirectQueries = 8;

/// Signed sum of an edge's uses in a group and a patch: +1 for a use that runs from the low to the high vertex, -1 for
/// the opposite.
struct Net {
    int group, patch, sum;
};

/// Sums the uses of an edge by group and patch. `each(use)` returns the Net of one use.
template <class Each>
void sumUp(const EdgeTable::Edge& edge, std::vector<Net>& nets, Each&& each) {
    nets.clear();
    for (const int use : edge.uses) nets.push_back(each(use));
    std::sort(nets.begin(), nets.end(),
              [](const Net& a, const Net& b) { return std::tie(a.group, a.patch) < std::tie(b.group, b.patch); });
    std::size_t kept = 0;
    for (const Net& n : nets) {
        if (kept > 0 && nets[kept - 1].group == n.group && nets[kept - 1].patch == n.patch)
            nets[kept - 1].sum += n.sum;
        else
            nets[kept++] = n;
    }
    nets.resize(kept);
}

/// Calls visit(first, last, sum) for each group in the result of sumUp().
template <class Visit>
void forEachGroup(const std::vector<Net>& nets, Visit&& visit) {
    for (std::size_t i = 0, j = 0; i < nets.size(); i = j) {
        int sum = 0;
        for (; j < nets.size() && nets[j].group == nets[i].group; ++j) sum += nets[j].sum;
        visit(nets.data() + i, nets.data() + j, sum);
    }
}

}  // namespace

Shells::Shells(WeldedMesh&& mesh, double apart, Pulse& pulse)
    : pulse_(pulse),
      thinnestLobe_(std::max(kThinnestLobe, kThinnestRounded * apart)),
      vertices_(std::move(mesh.vertices)),
      faces_(std::move(mesh.faces)),
      edges_(faces_, vertices_.size(), pulse),
      flipped_(faces_.size(), 0),
      buried_(faces_.size(), 0) {
    orient();
    group();
    makeShells();
    nest();
    do collectWalls();
    while (!markBuried());
}

/// Collects the faces and caps of the closed shells.
void Shells::collectWalls() {
    walls_.clear();
    wallFace_.clear();
    field_.reset();
    queries_ = 0;
    for (int s = 0; s < static_cast<int>(shells_.size()); ++s) {
        if (!shells_[s].closed) continue;
        for (const int f : facesOf_[s]) {
            walls_.push_back(cornersOf(f));
            wallFace_.push_back(f);
        }
        for (int c = shells_[s].firstCap; c < shells_[s].lastCap; ++c) {
            walls_.push_back(caps_[c]);
            wallFace_.push_back(-1);
        }
    }
}

Corners Shells::cornersOf(int face) const {
    Corners c = faces_[face];
    if (flipped_[face]) std::swap(c[1], c[2]);
    return c;
}

bool Shells::rises(const EdgeTable::Edge& e, int use) const {
    return (edges_.from(use) == e.low) != (flipped_[use / 3] != 0);
}

// Propagates the orientation of the first face across edges with exactly two faces. Then flips the patch if most of its
// faces were flipped.
void Shells::orient() {
    struct Neighbor {
        int face = -1;
        bool opposed = false;
    };
    std::vector<std::array<Neighbor, 3>> neighbors(faces_.size());
    edges_.forEach([&](const EdgeTable::Edge& e) {
        if (e.uses.size() != 2) return;
        const int a = e.uses[0], b = e.uses[1];
        const bool opposed = rises(e, a) == rises(e, b);
        neighbors[a / 3][a % 3] = {b / 3, opposed};
        neighbors[b / 3][b % 3] = {a / 3, opposed};
    });
    shellOf_.assign(faces_.size(), -1);
    std::vector<int> members;
    for (int seed = 0; seed < static_cast<int>(faces_.size()); ++seed) {
        if (shellOf_[seed] >= 0) continue;
        const int patch = static_cast<int>(groupOf_.size());
        groupOf_.push_back(patch);
        members.assign(1, seed);
        shellOf_[seed] = patch;
        for (std::size_t i = 0; i < members.size(); ++i) {
            pulse_();
            for (const auto& [other, opposed] : neighbors[members[i]])
                if (other >= 0 && shellOf_[other] < 0) {
                    shellOf_[other] = patch;
                    flipped_[other] = static_cast<char>((flipped_[members[i]] != 0) != opposed);
                    members.push_back(other);
                }
        }
        const auto minority = std::count_if(members.begin(), members.end(), [&](int f) { return flipped_[f] != 0; });
        if (2 * minority <= static_cast<std::ptrdiff_t>(members.size())) continue;
        for (const int f : members) flipped_[f] = static_cast<char>(flipped_[f] == 0);
    }
}

// A patch is a closed shell if the uses of each of its edges cancel. Open patches that share an edge are tried together
// as one group, and then again without the flaps on them.
void Shells::group() {
    edges_.forEach([&](const EdgeTable::Edge& e) {
        const bool cancels = e.uses.size() == 2 && shellOf_[e.uses[0] / 3] == shellOf_[e.uses[1] / 3] &&
                             rises(e, e.uses[0]) != rises(e, e.uses[1]);
        if (!cancels) odd_.push_back(e);
    });
    const std::vector<char> open = openGroups();
    DisjointSets sets(groupOf_.size());
    for (const EdgeTable::Edge& e : odd_) {
        int before = -1;
        for (const int use : e.uses) {
            const int patch = shellOf_[use / 3];
            if (!open[patch]) continue;
            if (before >= 0) sets.join(before, patch);
            before = patch;
        }
    }
    for (int& g : groupOf_) g = sets.find(g);
    patchArea_.assign(groupOf_.size(), 0);
    for (std::size_t f = 0; f < faces_.size(); ++f) patchArea_[shellOf_[f]] += areaOf(triangle(faces_[f]));
    for (int round = 0; round < kFlapRounds && dropFlaps(); ++round) {
    }
}

/// Whether each group is open, indexed by the group's name.
std::vector<char> Shells::openGroups() const {
    std::vector<char> open(2 * groupOf_.size(), 0);
    std::vector<Net> nets;
    for (const EdgeTable::Edge& e : odd_) {
        pulse_();
        sumUp(e, nets, [&](int use) { return Net{groupOf_[shellOf_[use / 3]], 0, rises(e, use) ? 1 : -1}; });
        for (const Net& n : nets)
            if (n.sum != 0) open[n.group] = 1;
    }
    return open;
}

// A flap is a patch of an open group whose removal makes all of its edges cancel, such as a partition that shares its
// rim with the walls around it. If two flaps share an edge, the smaller one is dropped, because a wall is larger
// than a partition across it. Each dropped flap becomes a separate group. Returns whether any flap was dropped.
bool Shells::dropFlaps() {
    const std::size_t patches = groupOf_.size();
    const std::vector<char> open = openGroups();
    // Only patches of open groups with several patches may be flaps.
    std::vector<int> members(2 * patches, 0);
    for (const int g : groupOf_) ++members[g];
    std::vector<char> kept(patches, 0);  // patches that are no flaps
    bool any = false;
    for (std::size_t p = 0; p < patches; ++p) {
        kept[p] = static_cast<char>(!open[groupOf_[p]] || members[groupOf_[p]] < 2);
        any = any || !kept[p];
    }
    if (!any) return false;
    std::vector<Net> nets;
    const auto forEachOpen = [&](auto&& visit) {
        for (const EdgeTable::Edge& e : odd_) {
            pulse_();
            sumUp(e, nets, [&](int use) {
                const int patch = shellOf_[use / 3];
                return Net{groupOf_[patch], patch, rises(e, use) ? 1 : -1};
            });
            forEachGroup(nets, visit);
        }
    };
    // A patch is kept if an open edge would stay open without it.
    forEachOpen([&](const Net* first, const Net* last, int sum) {
        for (const Net* n = first; n != last; ++n)
            if (n->sum != 0 && n->sum != sum) kept[n->patch] = 1;
    });
    // At each edge, only the smallest flap goes.
    std::vector<char> waiting(patches, 0);
    forEachOpen([&](const Net* first, const Net* last, int) {
        int least = -1;
        const auto smaller = [&](int a, int b) { return std::tie(patchArea_[a], a) < std::tie(patchArea_[b], b); };
        for (const Net* n = first; n != last; ++n)
            if (!kept[n->patch] && (least < 0 || smaller(n->patch, least))) least = n->patch;
        for (const Net* n = first; n != last; ++n)
            if (n->patch != least) waiting[n->patch] = 1;
    });
    bool dropped = false;
    for (std::size_t p = 0; p < patches; ++p)
        if (!kept[p] && !waiting[p]) {
            groupOf_[p] = static_cast<int>(patches + p);
            dropped = true;
        }
    return dropped;
}

void Shells::makeShells() {
    const std::vector<char> open = openGroups();
    std::vector<int> place(2 * groupOf_.size(), -1);
    for (int& s : shellOf_) {
        const int g = groupOf_[s];
        if (place[g] < 0) {
            place[g] = static_cast<int>(shells_.size());
            shells_.emplace_back();
            shells_.back().closed = !open[g];
        }
        s = place[g];
    }
    facesOf_ = Grouped(faces_.size(), shells_.size(), [&](int f) { return shellOf_[f]; });
    std::vector<Gap> gaps;
    std::vector<Net> nets;
    for (const EdgeTable::Edge& e : odd_) {
        sumUp(e, nets, [&](int use) { return Net{shellOf_[use / 3], 0, rises(e, use) ? 1 : -1}; });
        for (const Net& n : nets)
            for (int k = 0; k < std::abs(n.sum); ++k) {
                const auto use = std::find_if(e.uses.begin(), e.uses.end(), [&](int u) {
                    return shellOf_[u / 3] == n.group && rises(e, u) == (n.sum > 0);
                });
                gaps.push_back({n.group, e.low, e.high, n.sum > 0, *use / 3});
            }
    }
    std::sort(gaps.begin(), gaps.end(), [](const Gap& a, const Gap& b) {
        return std::tie(a.shell, a.low, a.high) < std::tie(b.shell, b.low, b.high);
    });
    std::size_t next = 0;
    for (int s = 0; s < static_cast<int>(shells_.size()); ++s) {
        const std::size_t first = next;
        while (next < gaps.size() && gaps[next].shell == s) ++next;
        measure(s, {gaps.data() + first, next - first});
    }
}

// Computes the volume and the box of a shell, and closes holes: for sure, or small ones by a cone over each connected
// piece of the rim.
void Shells::measure(int s, std::span<const Gap> gaps) {
    Shell& shell = shells_[s];
    double area = 0;
    for (const int f : facesOf_[s]) {
        pulse_();
        const Triangle t = triangle(cornersOf(f));
        area += areaOf(t);
        for (const Vec3& v : t) shell.box.add(v);
    }
    const std::size_t vertices = vertices_.size(), caps = caps_.size(), closedHoles = closedHoles_.size();
    const auto dropCaps = [&] {
        vertices_.resize(vertices);
        caps_.resize(caps);
        closedHoles_.resize(closedHoles);
    };
    bool opening = false;
    const std::vector<Gap> left = gaps.empty() ? std::vector<Gap>() : closeHoles(gaps, area, opening);
    const std::size_t guesses = caps_.size();
    const int rims = addCones(left);
    double capArea = 0;
    for (std::size_t c = guesses; c < caps_.size(); ++c) capArea += areaOf(triangle(caps_[c]));
    if (capArea > kSmallHoles * area) dropCaps();

    const Vec3 base = shell.box.center();  // any point is correct; a near one limits the rounding errors
    const auto addTetrahedron = [&](const Triangle& t) {
        shell.volume += (t[0] - base).dot((t[1] - base).cross(t[2] - base)) / 6;
    };
    for (const int f : facesOf_[s]) addTetrahedron(triangle(cornersOf(f)));
    for (std::size_t c = caps; c < caps_.size(); ++c) addTetrahedron(triangle(caps_[c]));
    const bool bounds = shell.closed || caps_.size() > caps;
    const bool thick = 2 * std::abs(shell.volume) > kThinnest * area;
    // A surface with its front toward the inside is that of an opening, not of a solid.
    const bool solid = bounds && thick && !(opening && shell.volume < 0);
    if (solid && !shell.closed) shell.holes = rims;
    shell.closed = solid;
    if (!shell.closed) dropCaps();
    shell.firstCap = static_cast<int>(caps);
    shell.firstGuess = std::min(static_cast<int>(guesses), static_cast<int>(caps_.size()));
    shell.lastCap = static_cast<int>(caps_.size());
}

// Closes the holes that one flat or smooth cap completes, and returns the gaps of the others. Sets `opening` if a cap
// closes a wide opening.
std::vector<Shells::Gap> Shells::closeHoles(std::span<const Gap> gaps, double area, bool& opening) {
    // The edges of the rims, each with the normal of its face.
    const auto runs = [](const Gap& g) { return g.rises ? std::pair(g.high, g.low) : std::pair(g.low, g.high); };
    std::vector<RimEdge> edges;
    for (const Gap& g : gaps) {
        const Triangle t = triangle(cornersOf(g.face));
        const auto [from, to] = runs(g);
        edges.push_back(
            {from, to, isUsable(t) ? Vec3((t[1] - t[0]).cross(t[2] - t[0]).normalized()) : Vec3(Vec3::Zero())});
    }
    struct Found {
        std::vector<RimLoop> hole;
        MeshCap cap;
        bool opening, crossed = false;
    };
    // A cap for each hole, if its shape and size allow one.
    std::vector<Found> found;
    double openings = 0;
    int count = 0;
    for (std::vector<RimLoop>& hole : flatHoles(vertices_, rimLoops(std::move(edges)))) {
        pulse_();
        std::optional<MeshCap> cap = capOf(vertices_, hole);
        if (!cap) continue;
        const bool flat = cap->flat || cap->level, goesOn = cap->continued >= (flat ? kFlatRim : kSmoothRim);
        const double limit = goesOn ? (flat ? kFlatCap : kSmoothCap) : cap->flat ? kOpening : 0;
        if (!(cap->area <= limit * (area + cap->area))) continue;
        if (!goesOn) {
            openings += cap->area;
            ++count;
        }
        found.push_back({std::move(hole), std::move(*cap), !goesOn});
    }
    const bool wide = openings > kSmallHoles * area;
    if (count > 1 && wide) std::erase_if(found, [](const Found& f) { return f.opening; });

    // Find the caps that cross another face: they close nothing.
    std::vector<Corners> near;
    std::vector<Box> boxes;
    for (const Found& f : found) {
        near.insert(near.end(), f.cap.faces.begin(), f.cap.faces.end());
        for (const Corners& c : f.cap.faces) {
            boxes.emplace_back();
            for (const Vec3& v : triangle(c)) boxes.back().add(v);
        }
    }
    if (found.empty()) return {gaps.begin(), gaps.end()};
    const BoxTree tree(boxes);
    const std::vector<Box> ordered = inOrder(tree.order(), boxes);
    for (const Corners& c : faces_) {
        Box box;
        for (const Vec3& v : triangle(c)) box.add(v);
        if (anyMeeting(tree, ordered, box, [](int) { return true; })) near.push_back(c);
    }
    const std::vector<char> crossed = crossedFaces(vertices_, near, pulse_);
    // Add the other caps, and note the edges that they close.
    std::multimap<std::pair<int, int>, char> closed;
    std::size_t next = 0;
    for (Found& f : found) {
        for (std::size_t k = 0; k < f.cap.faces.size(); ++k) f.crossed = f.crossed || crossed[next++];
        if (f.crossed) continue;
        opening = opening || (f.opening && wide);
        Box box;
        for (const RimLoop& loop : f.hole)
            for (const RimEdge& e : loop) {
                closed.emplace(std::pair(e.from, e.to), 0);
                box.add(vertices_[e.from]);
            }
        caps_.insert(caps_.end(), f.cap.faces.begin(), f.cap.faces.end());
        closedHoles_.push_back({box.center(), (box.hi - box.lo).norm(), int(f.cap.faces.size())});
    }
    // The gaps that stay open.
    std::vector<Gap> left;
    for (const Gap& g : gaps) {
        const auto it = closed.find(runs(g));
        if (it == closed.end())
            left.push_back(g);
        else
            closed.erase(it);
    }
    return left;
}

// Adds one cone per connected piece of the rim, with its apex at the piece's centroid. The cone's edges are opposed to
// the gaps, so that all edges cancel. Returns the number of pieces.
int Shells::addCones(std::span<const Gap> gaps) {
    std::vector<int> rim;
    for (const Gap& g : gaps) rim.insert(rim.end(), {g.low, g.high});
    std::sort(rim.begin(), rim.end());
    rim.erase(std::unique(rim.begin(), rim.end()), rim.end());
    const auto local = [&](int v) {
        return static_cast<int>(std::lower_bound(rim.begin(), rim.end(), v) - rim.begin());
    };
    DisjointSets pieces(rim.size());
    for (const Gap& g : gaps) pieces.join(local(g.low), local(g.high));
    std::vector<Vec3> sum(rim.size(), Vec3::Zero());
    std::vector<int> count(rim.size(), 0), apex(rim.size(), -1);
    for (std::size_t l = 0; l < rim.size(); ++l) {
        const int piece = pieces.find(static_cast<int>(l));
        sum[piece] += vertices_[rim[l]];
        ++count[piece];
    }
    int rims = 0;
    for (std::size_t l = 0; l < rim.size(); ++l) {
        if (count[l] == 0) continue;
        apex[l] = static_cast<int>(vertices_.size());
        vertices_.push_back(sum[l] / count[l]);
        ++rims;
    }
    for (const Gap& g : gaps) {
        const int top = apex[pieces.find(local(g.low))];
        caps_.push_back(g.rises ? Corners{g.high, g.low, top} : Corners{g.low, g.high, top});
    }
    return rims;
}

void Shells::flip(int s) {
    for (const int f : facesOf_[s]) flipped_[f] = static_cast<char>(flipped_[f] == 0);
    for (int c = shells_[s].firstCap; c < shells_[s].lastCap; ++c) std::swap(caps_[c][1], caps_[c][2]);
}

// Orients all closed shells outward. A shell wholly inside another one whose original orientation was opposed to it is
// a cavity: it is oriented inward again.
void Shells::nest() {
    std::vector<int> closed;  // sorted below, the largest first
    for (int s = 0; s < static_cast<int>(shells_.size()); ++s) {
        if (!shells_[s].closed) continue;
        closed.push_back(s);
        if (shells_[s].volume < 0) flip(s);
    }
    // Without an opposed pair there is no cavity.
    const auto inward = [&](int s) { return shells_[s].volume < 0; };
    if (std::all_of(closed.begin(), closed.end(), inward) || std::none_of(closed.begin(), closed.end(), inward)) return;
    std::sort(closed.begin(), closed.end(), [&](int a, int b) {
        const double va = std::abs(shells_[a].volume), vb = std::abs(shells_[b].volume);
        return va > vb || (va == vb && a < b);
    });
    std::vector<Box> boxes;
    for (const int s : closed) boxes.push_back(shells_[s].box);
    const BoxTree tree(boxes);
    const std::vector<Box> ordered = inOrder(tree.order(), boxes);
    // Whether a shell contains another: the winding number at each of its faces says so.
    std::map<int, TriangleBvh> fields;
    const auto contains = [&](int outer, int inner) {
        auto it = fields.find(outer);
        if (it == fields.end()) {
            std::vector<Triangle> all;
            for (int c = shells_[outer].firstCap; c < shells_[outer].lastCap; ++c) all.push_back(triangle(caps_[c]));
            for (const int f : facesOf_[outer]) all.push_back(triangle(cornersOf(f)));
            it = fields.emplace(outer, TriangleBvh(std::move(all))).first;
        }
        const auto faces = facesOf_[inner];
        return std::all_of(faces.begin(), faces.end(), [&](int f) {
            pulse_();
            return it->second.windingNumber(vertices_[cornersOf(f)[0]]) >= 0.5;
        });
    };
    // For each shell, the larger ones whose boxes contain its box.
    std::vector<int> cavities, around;
    for (int i = 1; i < static_cast<int>(closed.size()); ++i) {
        around.clear();
        anyMeeting(tree, ordered, boxes[i], [&](int place) {
            const int j = tree.order()[place];
            const bool larger = j < i && (boxes[i].lo.array() > boxes[j].lo.array()).all() &&
                                (boxes[i].hi.array() < boxes[j].hi.array()).all();
            if (larger) around.push_back(j);
            return false;
        });
        // The largest container decides.
        std::sort(around.begin(), around.end());
        const auto outer =
            std::find_if(around.begin(), around.end(), [&](int j) { return contains(closed[j], closed[i]); });
        if (outer != around.end() && inward(closed[i]) != inward(closed[*outer])) cavities.push_back(closed[i]);
    }
    for (const int s : cavities) {
        flip(s);
        shells_[s].cavity = true;
    }
}

// Marks the walls that lie inside the union of all shells. Walls that meet at edges of exactly two walls and that no
// other wall crosses form a piece. The winding number is constant on each side of a piece, so one probe on each side of
// its largest wall decides for the whole piece. Where a shell crosses itself, a part of it may be inside out: the
// winding number in front of it is negative, as otherwise only where cavities overlap. Such a shell becomes a sheet,
// and the others have to be marked again: returns false.
bool Shells::markBuried() {
    if (walls_.empty()) return true;
    const std::vector<char> crossed = crossedFaces(vertices_, walls_, pulse_);
    std::vector<int> wallOf(faces_.size(), -1);
    for (int w = 0; w < static_cast<int>(walls_.size()); ++w)
        if (wallFace_[w] >= 0 && !crossed[w]) wallOf[wallFace_[w]] = w;
    DisjointSets pieces(walls_.size());
    edges_.forEach([&](const EdgeTable::Edge& e) {
        if (e.uses.size() != 2) return;
        const int a = wallOf[e.uses[0] / 3], b = wallOf[e.uses[1] / 3];
        if (a >= 0 && b >= 0) pieces.join(a, b);
    });
    std::vector<int> largest(walls_.size(), -1);
    int count = 0;
    bool anyCrossed = false;
    for (int w = 0; w < static_cast<int>(walls_.size()); ++w) {
        anyCrossed = anyCrossed || crossed[w];
        if (crossed[w] || wallFace_[w] < 0) continue;
        int& best = largest[pieces.find(w)];
        count += best < 0;
        if (best < 0 || areaOf(triangle(walls_[w])) > areaOf(triangle(walls_[best]))) best = w;
    }
    if (count == 1 && !anyCrossed) return true;  // there is only one shell
    std::vector<char> hidden(walls_.size(), 0);
    const int before = insideOut_;
    for (std::size_t p = 0; p < largest.size(); ++p) {
        if (largest[p] < 0) continue;
        pulse_();
        const Triangle t = triangle(walls_[largest[p]]);
        if (!isUsable(t) || altitudeOf(t) <= thinnestLobe_) continue;  // rounding may have folded it into its own shell
        const Vec3 middle = (t[0] + t[1] + t[2]) / 3, normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
        const Vec3 offset = kTouching * normal, lobe = thinnestLobe_ * normal;
        const double ahead = winding(middle + offset);
        hidden[p] = static_cast<char>(ahead >= 0.5 && inside(middle - offset));
        Shell& shell = shells_[shellOf_[wallFace_[largest[p]]]];
        if (ahead <= -0.5 && shell.closed && !shell.cavity && winding(middle + lobe) <= -0.5) {
            shell.closed = false;
            shell.lastCap = shell.firstGuess = shell.firstCap;
            shell.holes = 0;
            ++insideOut_;
        }
    }
    if (insideOut_ > before) return false;
    for (int w = 0; w < static_cast<int>(walls_.size()); ++w)
        if (wallFace_[w] >= 0 && !crossed[w]) buried_[wallFace_[w]] = hidden[pieces.find(w)];
    return true;
}

double Shells::winding(const Vec3& p) {
    if (++queries_ <= kDirectQueries) {
        double sum = 0;
        for (const Corners& w : walls_) sum += solidAngleShare(p, triangle(w));
        return sum;
    }
    if (!field_) {
        std::vector<Triangle> all;
        all.reserve(walls_.size());
        for (const Corners& w : walls_) all.push_back(triangle(w));
        field_.emplace(std::move(all));
    }
    return field_->windingNumber(p);
}

bool Shells::insideBothSides(const Vec3& p, const Triangle& t) {
    const Vec3 offset = kTouching * (t[1] - t[0]).cross(t[2] - t[0]).normalized();
    return inside(p + offset) && inside(p - offset);
}

bool Shells::encloses(const Triangle& sheet) {
    if (walls_.empty()) return false;
    pulse_();
    const Vec3 middle = (sheet[0] + sheet[1] + sheet[2]) / 3;
    // A corner may lie on a wall, where the winding number is undefined: test a point next to it.
    return insideBothSides(middle, sheet) && std::all_of(sheet.begin(), sheet.end(), [&](const Vec3& corner) {
               return insideBothSides(corner + 1e-3 * (middle - corner), sheet);
           });
}

int Shells::holes() const {
    int sum = 0;
    for (const Shell& shell : shells_) sum += shell.holes;
    return sum;
}

int Shells::turned() const {
    return int(std::count_if(wallFace_.begin(), wallFace_.end(), [&](int f) { return f >= 0 && flipped_[f]; }));
}

void Shells::append(std::vector<Face>& out, std::vector<Triangle>& sure) {
    exposed_.assign(shells_.size(), 0);
    out.reserve(out.size() + faces_.size() + caps_.size());
    for (int s = 0; s < static_cast<int>(shells_.size()); ++s) {
        for (const int f : facesOf_[s]) {
            const Triangle t = triangle(cornersOf(f));
            if (shells_[s].closed)
                out.push_back({t, buried_[f] ? FaceRole::Buried : FaceRole::Wall, false});
            else if (isUsable(t)) {  // a degenerate face of an open shell is skipped
                out.push_back({t, FaceRole::Sheet, !encloses(t)});
                exposed_[s] += out.back().exposed;
            }
        }
        for (int c = shells_[s].firstCap; c < shells_[s].lastCap; ++c) {
            const bool isSure = c < shells_[s].firstGuess;
            out.push_back({triangle(caps_[c]), isSure ? FaceRole::Wall : FaceRole::Cap, false});
            if (isSure && isUsable(out.back().corners)) sure.push_back(out.back().corners);
        }
    }
}

bool Shells::addLooseSheets(double attached, std::vector<std::vector<int>>& sheets) {
    double closed = 0, free = 0;
    std::vector<char> isWall(vertices_.size(), 0);
    const auto cornersIn = [&](int s) {
        std::vector<int> corners;
        for (const int f : facesOf_[s]) corners.insert(corners.end(), faces_[f].begin(), faces_[f].end());
        return corners;
    };
    for (int s = 0; s < static_cast<int>(shells_.size()); ++s) {
        if (!shells_[s].closed) continue;
        for (const int f : facesOf_[s]) closed += areaOf(triangle(faces_[f]));
        for (const int v : cornersIn(s)) isWall[v] = 1;
    }
    std::vector<int> loose, flaps;
    for (int s = 0; s < static_cast<int>(shells_.size()); ++s) {
        if (shells_[s].closed || exposed_[s] == 0) continue;
        double area = 0;
        Vec3 vector = Vec3::Zero();
        for (const int f : facesOf_[s]) {
            const Triangle t = triangle(cornersOf(f));
            const Vec3 twice = (t[1] - t[0]).cross(t[2] - t[0]);
            area += areaOf(t);
            vector += twice;
        }
        if (vector.norm() / 2 < kNearlyFlat * area) continue;
        const std::vector<int> corners = cornersIn(s);
        const bool isFlap = std::any_of(corners.begin(), corners.end(), [&](int v) { return isWall[v]; });
        (isFlap ? flaps : loose).push_back(s);
        (isFlap ? attached : free) += area;
    }
    if (free > kLooseSheets * closed) loose.clear();
    if (attached > kFlaps * closed) {
        flaps.clear();
        sheets.clear();
    }
    for (const std::vector<int>& group : {loose, flaps})
        for (const int s : group) {
            shells_[s].loose = true;
            sheets.push_back(cornersIn(s));
        }
    return !sheets.empty();
}

std::vector<Corners> Shells::keptFaces() const {
    std::vector<Corners> kept;
    for (std::size_t f = 0; f < faces_.size(); ++f)
        if (!shells_[shellOf_[f]].loose) kept.push_back(faces_[f]);
    return kept;
}

std::vector<Corners> Shells::buriedWalls() const {
    std::vector<Corners> out;
    for (std::size_t w = 0; w < walls_.size(); ++w)
        if (wallFace_[w] >= 0 && buried_[wallFace_[w]]) out.push_back(walls_[w]);
    return out;
}

std::pair<std::vector<Vec3>, std::vector<Corners>> Shells::walls() && {
    std::size_t kept = 0;
    for (std::size_t w = 0; w < walls_.size(); ++w)
        if (wallFace_[w] < 0 || !buried_[wallFace_[w]]) walls_[kept++] = walls_[w];
    walls_.resize(kept);
    return {std::move(vertices_), std::move(walls_)};
}

}  // namespace touchstone
