#include "haptics/surface/surface_features.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "haptics/builder/mesh_faces.hpp"

namespace touchstone {
namespace {

/// Quadruple precision, in which the determinant below is exact for coordinates of single precision, and correct to
/// 1e-33 of the size of the part for others.
__extension__ using Wide = __float128;

/// The smallest sine of the angle between a spoke and a vertex's supporting plane. With a smaller value rounding would
/// decide; a vertex dropped for this rises above its neighbors by less than 1e-13 of their distance.
constexpr double kStrict = 1e-13;
/// Half of the solid angle, sr, from which on a pit is no vertex. With a smaller one tips from which slivers fold off
/// more than they have would be missing; with a larger one shallow pits would cost time.
constexpr double kPit = 1e-3;
/// Altitude of a sliver as a share of its longest side. With a larger share the faces of fine meshes with coarse
/// coordinates would count; with a smaller one slivers at short edges would not.
constexpr double kSlender = 0.02;
/// Factor by which a flip has to widen the thinnest of its two faces. With a smaller one a short edge of a sliver would
/// be handed around; with a larger one slivers of small faces would stay.
constexpr double kWidened = 2;
/// Maximum number of rounds of flips. A flip may make the next one possible; more follow each other only in broken
/// meshes, whose slivers stay faces.
constexpr int kFlipRounds = 16;
/// Altitude of a needle, mm: the swept tests widen faces and edges by as much at their borders (feature_crossing.cpp),
/// so that those beside a needle cover it. With a larger one something passes between them; with a smaller one the
/// normals of faces would be off by more than 1e-5 rad.
constexpr double kNeedle = 1e-9;
/// Maximum number of needles that are passed to find the face beyond them. More lie in a row only in broken meshes.
constexpr int kNeedles = 16;

template <class Real>
Real determinant(const std::array<Real, 3>& a, const std::array<Real, 3>& b, const std::array<Real, 3>& c) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/// 1 if p lies in front of the triangle, -1 behind, 0 in its plane. The bound on the rounding error is that of J.
/// Shewchuk, Adaptive precision floating-point arithmetic, Discrete & Computational Geometry 18 (1997).
int sideOf(const Vec3& p, const Triangle& t) {
    const auto from = [&]<class Real>(const Vec3& q, Real) {
        return std::array{Real(q[0]) - Real(t[0][0]), Real(q[1]) - Real(t[0][1]), Real(q[2]) - Real(t[0][2])};
    };
    const auto signOf = [](auto x) { return (x > 0) - (x < 0); };
    const auto a = from(t[1], 0.0), b = from(t[2], 0.0), c = from(p, 0.0);
    const double rough = determinant(a, b, c);
    const auto product = [&](int x, int y, int z) {
        return std::abs(a[x]) * (std::abs(b[y] * c[z]) + std::abs(b[z] * c[y]));
    };
    if (std::abs(rough) > 1e-15 * (product(0, 1, 2) + product(1, 2, 0) + product(2, 0, 1))) return signOf(rough);
    return signOf(determinant(from(t[1], Wide()), from(t[2], Wide()), from(p, Wide())));
}

/// The point nearest to the origin of the convex hull of up to four points, of which only those that it lies between
/// are kept. It is zero if the hull of four contains the origin.
Vec3 nearestOfHull(std::vector<Vec3>& points) {
    const auto contains = [&] {
        for (int k = 0; k < 4; ++k) {
            const Vec3 &a = points[(k + 1) % 4], &b = points[(k + 2) % 4], &c = points[(k + 3) % 4];
            const Vec3 normal = (b - a).cross(c - a);
            if (normal.dot(-a) * normal.dot(points[k] - a) < 0) return false;
        }
        return true;
    };
    if (points.size() == 4 && contains()) return Vec3::Zero();
    std::vector<Vec3> kept{points[0]};
    Vec3 nearest = points[0];
    const auto offer = [&](const Vec3& x, std::initializer_list<Vec3> of) {
        if (x.squaredNorm() >= nearest.squaredNorm()) return;
        nearest = x;
        kept = of;
    };
    const std::size_t n = points.size();
    for (std::size_t i = 0; i < n; ++i) {
        const Vec3& a = points[i];
        offer(a, {a});
        for (std::size_t j = i + 1; j < n; ++j) {
            const Vec3 &b = points[j], ab = b - a;
            const double t = -a.dot(ab) / ab.squaredNorm();
            if (t > 0 && t < 1) offer(a + t * ab, {a, b});
            for (std::size_t k = j + 1; k < n; ++k) {
                const Vec3 &c = points[k], normal = ab.cross(c - a);
                const Vec3 x = normal * (normal.dot(a) / normal.squaredNorm());
                const bool inside = normal.dot((a - x).cross(b - x)) > 0 && normal.dot((b - x).cross(c - x)) > 0 &&
                                    normal.dot((c - x).cross(a - x)) > 0;
                if (inside) offer(x, {a, b, c});
            }
        }
    }
    points = kept;
    return nearest;
}

/// A vector that forms an acute angle with all these unit vectors, if there is one: toward the point of their convex
/// hull that is nearest to the origin. Source: E. Gilbert, D. Johnson, S. Keerthi, A fast procedure for computing the
/// distance between complex objects, IEEE J. Robotics and Automation 4 (1988).
std::optional<Vec3> findSupport(const std::vector<Vec3>& directions) {
    std::vector<Vec3> simplex;
    Vec3 x = directions.front();
    for (std::size_t step = 0; step < directions.size() + 8; ++step) {
        const auto lowest = std::min_element(directions.begin(), directions.end(),
                                             [&](const Vec3& a, const Vec3& b) { return a.dot(x) < b.dot(x); });
        if (lowest->dot(x) > kStrict * x.norm()) return x;
        if (std::find(simplex.begin(), simplex.end(), *lowest) != simplex.end()) return std::nullopt;
        simplex.push_back(*lowest);
        x = nearestOfHull(simplex);
        if (x.norm() < kStrict) return std::nullopt;
    }
    return x;  // undecided: a vertex too many costs only time
}

/// Finds the features. A use is the number 3 * face + side, as in EdgeTable. Buried faces are no features, but they
/// complete the wedges and fans of the walls that meet them.
class FeatureFinder {
  public:
    FeatureFinder(const RepairedMesh& body, Pulse& pulse)
        : body_(body),
          pulse_(pulse),
          corners_(body.walls),
          partner_(3 * (body.walls.size() + body.buried.size()), -1),
          needle_(body.walls.size() + body.buried.size(), 0),
          faceOf_(body.walls.size(), -1),
          crowded_(body.vertices.size(), 0) {
        corners_.insert(corners_.end(), body.buried.begin(), body.buried.end());
    }

    SurfaceFeatures find() &&;

  private:
    /// The two uses at an edge between which there is material, counter-clockwise about the edge from low to high.
    struct Wedge {
        int begin, end;
        bool outer;  ///< not inside another wedge at this edge
    };

    const Vec3& point(int corner) const { return body_.vertices[corner]; }
    Triangle triangle(int face) const {
        const Corners& c = corners_[face];
        return {point(c[0]), point(c[1]), point(c[2])};
    }
    int endOf(int use) const { return corners_[use / 3][(use % 3 + 1) % 3]; }
    int opposite(int use) const { return corners_[use / 3][(use % 3 + 2) % 3]; }
    bool isWall(int face) const { return face < int(body_.walls.size()); }

    /// Whether a face is thinner than this, and slender.
    bool isThin(const Triangle& t, double altitude) const {
        return altitudeOf(t) <= std::min(altitude, kSlender * std::sqrt(longestEdge(t).length2));
    }
    /// Whether two neighbors face in opposite directions.
    bool isFolded(const Corners& s, const Corners& t) const {
        const auto normal = [&](const Corners& c) {
            return Vec3((point(c[1]) - point(c[0])).cross(point(c[2]) - point(c[0])));
        };
        return normal(s).dot(normal(t)) < 0;
    }
    void flipSlivers();
    bool flip(int ab, std::vector<int>& twins);
    void findWedges();
    void addWedges(const EdgeTable& table, const EdgeTable::Edge& edge);
    int beyondNeedles(int use, const Vec3& at) const;
    void addEdge(const Wedge& wedge);
    bool isSupported(int vertex, std::span<const int> fan);
    void addVertices();

    const RepairedMesh& body_;
    Pulse& pulse_;
    std::vector<Corners> corners_;  ///< by face: walls, then buried faces
    std::vector<Wedge> wedges_;
    std::vector<int> partner_;      ///< by use: the other use of its wedge; -1: none
    std::vector<char> needle_;      ///< by face
    std::vector<int> faceOf_;       ///< by wall: the index of its face; -1 for needles
    std::vector<char> crowded_;     ///< by vertex: whether it is an end of an edge of more than two faces
    std::vector<Vec3> directions_;  ///< of spokes
    SurfaceFeatures out_;
};

/// The direction of a sliver as thin as the rounding of the file is rounding. Its longest side, or one at which it is
/// folded back over its neighbor, gives way to the edge between the corners opposite to it, which moves the surface by
/// less than that rounding and leaves no gap.
void FeatureFinder::flipSlivers() {
    const int n = int(corners_.size());
    const auto isSliver = [&](int face) {
        const Triangle t = triangle(face);
        return !isUsable(t) || isThin(t, body_.thin);
    };
    std::vector<int> slivers;
    for (int f = 0; f < n; ++f)
        if (isSliver(f)) slivers.push_back(f);
    if (slivers.empty()) return;
    std::vector<int> twins(3 * corners_.size(), -1);  // by use: the other one of an edge of two faces
    const EdgeTable table(corners_, body_.vertices.size(), pulse_);
    table.forEach([&](const EdgeTable::Edge& edge) {
        if (edge.uses.size() != 2 || table.from(edge.uses[0]) == table.from(edge.uses[1])) return;
        twins[edge.uses[0]] = edge.uses[1];
        twins[edge.uses[1]] = edge.uses[0];
    });
    bool any = true;
    for (int round = 0; round < kFlipRounds && any; ++round) {
        any = false;
        for (const int f : slivers) {
            pulse_();
            for (int side = 0; side < 3; ++side) {
                if (!isSliver(f) || !flip(3 * f + side, twins)) continue;
                ++out_.dropped.needles;
                any = true;
            }
        }
    }
}

/// Flips an edge if that unfolds its two faces or, at the longest side of the first one, widens the thinner of them.
bool FeatureFinder::flip(int ab, std::vector<int>& twins) {
    const auto next = [](int use) { return use - use % 3 + (use + 1) % 3; };
    const int face = ab / 3, ba = twins[ab];
    if (ba < 0 || isWall(face) != isWall(ba / 3)) return false;
    const int other = ba / 3, bc = next(ab), ca = next(bc), ad = next(ba), db = next(ad);
    const int a = corners_[face][ab % 3], b = endOf(ab), c = opposite(ab), d = opposite(ba);
    if (c == d) return false;
    const auto altitude = [&](int i, int j, int k) {
        const Triangle t{point(i), point(j), point(k)};
        return isUsable(t) ? altitudeOf(t) : 0;
    };
    const double before = std::min(altitude(a, b, c), altitude(b, a, d));
    const double after = std::min(altitude(a, d, c), altitude(d, b, c));
    const bool widens = ab % 3 == longestEdge(triangle(face)).first && after > kWidened * before;
    const bool unfolds = after > 0 && isFolded({a, b, c}, {b, a, d}) && !isFolded({a, d, c}, {d, b, c});
    if (!widens && !unfolds) return false;
    for (int use = bc;;) {  // from a corner to c, in the faces around it: the new edge must not be one already
        use = twins[next(use)];
        if (use < 0 || corners_[use / 3][use % 3] == d) return false;
        if (use == bc) break;
    }
    const std::array<std::pair<int, int>, 4> outer{
        {{3 * face, twins[ad]}, {3 * face + 2, twins[ca]}, {3 * other, twins[db]}, {3 * other + 1, twins[bc]}}};
    corners_[face] = {a, d, c};
    corners_[other] = {d, b, c};
    for (const auto& [use, twin] : outer) {
        twins[use] = twin;
        if (twin >= 0) twins[twin] = use;
    }
    twins[3 * face + 1] = 3 * other + 2;
    twins[3 * other + 2] = 3 * face + 1;
    return true;
}

void FeatureFinder::findWedges() {
    const EdgeTable table(corners_, body_.vertices.size(), pulse_);
    table.forEach([&](const EdgeTable::Edge& edge) {
        pulse_();
        addWedges(table, edge);
    });
}

void FeatureFinder::addWedges(const EdgeTable& table, const EdgeTable::Edge& edge) {
    // Material begins at a face that runs down the edge, and ends at one that runs up.
    struct Use {
        int use;
        bool up;
        double angle;
    };
    std::vector<Use> around;
    const Vec3 along = (point(edge.high) - point(edge.low)).normalized();
    const Vec3 aside = along.unitOrthogonal(), across = along.cross(aside);
    int up = 0;
    for (const int use : edge.uses) {
        const Vec3 wing = point(opposite(use)) - point(edge.low);
        around.push_back({use, table.from(use) == edge.low, std::atan2(wing.dot(across), wing.dot(aside))});
        up += around.back().up;
    }
    if (2 * up != int(around.size())) {
        ++out_.dropped.buriedEdges;
        return;
    }
    if (around.size() > 2) {
        crowded_[edge.low] = crowded_[edge.high] = 1;
        std::sort(around.begin(), around.end(),
                  [](const Use& a, const Use& b) { return a.angle < b.angle || (a.angle == b.angle && a.up < b.up); });
    }
    // The walk begins where no shell has material: after the use at which the depth is least.
    const std::size_t n = around.size();
    std::size_t begin = 0;
    for (int i = 0, depth = 0, least = 0; i < int(n); ++i)
        if ((depth += around[i].up ? -1 : 1) < least) least = depth, begin = i + 1;
    std::vector<int> begun;
    for (std::size_t i = 0; i < n; ++i) {
        const Use& use = around[(begin + i) % n];
        if (!use.up) {
            begun.push_back(use.use);
            continue;
        }
        const Wedge wedge{begun.back(), use.use, begun.size() == 1};
        begun.pop_back();
        partner_[wedge.begin] = wedge.end;
        partner_[wedge.end] = wedge.begin;
        wedges_.push_back(wedge);
    }
}

/// The face at this use or, where that is a needle, the face beyond it as seen from a point of the edge; -1 if there is
/// none.
int FeatureFinder::beyondNeedles(int use, const Vec3& at) const {
    for (int step = 0; step < kNeedles && use >= 0; ++step) {
        const int face = use / 3;
        if (!needle_[face]) return face;
        // All sides of a needle lie on a line: it is left through the longest one or, if it was entered through that,
        // through the other side that contains the point.
        const Triangle t = triangle(face);
        int side = longestEdge(t).first;
        if (side == use % 3) {
            side = (side + 1) % 3;
            const Vec3 &tip = t[(side + 1) % 3], toSide = t[side] - tip;
            if ((at - tip).dot(toSide) < 0) side = (side + 1) % 3;
        }
        use = partner_[3 * face + side];
    }
    return -1;
}

void FeatureFinder::addEdge(const Wedge& wedge) {
    // Where a needle's longest side is an edge, the two others stand for it.
    for (const int use : {wedge.begin, wedge.end})
        if (needle_[use / 3] && longestEdge(triangle(use / 3)).first == use % 3) return;
    const int a = corners_[wedge.begin / 3][wedge.begin % 3], b = endOf(wedge.begin);
    const Vec3 middle = (point(a) + point(b)) / 2;
    const int begin = beyondNeedles(wedge.begin, middle), end = beyondNeedles(wedge.end, middle);
    if (begin < 0 || end < 0) {
        ++out_.dropped.buriedEdges;
        return;
    }
    // The corner of the end's face that is farthest from the edge decides; the face beyond needles has other corners.
    int wing = opposite(wedge.end);
    if (end != wedge.end / 3) {
        const Vec3 along = (point(b) - point(a)).normalized();
        const Corners& c = corners_[end];
        const auto distance = [&](int v) { return (point(v) - point(a)).cross(along).squaredNorm(); };
        wing = *std::max_element(c.begin(), c.end(), [&](int v, int w) { return distance(v) < distance(w); });
    }
    int bend = sideOf(point(wing), triangle(begin));
    // Two faces in one plane, folded back to back: a fin without thickness.
    if (bend == 0 && isFolded(corners_[begin], corners_[end])) bend = -1;
    if (!wedge.outer || !isWall(begin) || !isWall(end))
        ++out_.dropped.buriedEdges;
    else if (bend < 0)
        out_.edges.push_back({{a, b}, {faceOf_[begin], faceOf_[end]}});
    else
        ++(bend > 0 ? out_.dropped.concaveEdges : out_.dropped.flatEdges);
}

/// Whether a plane touches the material around a vertex in that point alone. If all spokes are strictly on one side of
/// a plane, the material is there or everywhere else: the solid angle of the fan says where, to which
/// slivers count that are folded back over other faces.
bool FeatureFinder::isSupported(int vertex, std::span<const int> fan) {
    directions_.clear();
    for (const int use : fan) directions_.push_back((point(endOf(use)) - point(vertex)).normalized());
    const std::optional<Vec3> support = findSupport(directions_);
    if (!support) return false;
    const Vec3 inward = support->normalized();
    double angle = 0;  // half of it. Source: A. van Oosterom, J. Strackee, The solid angle of a plane triangle (1983).
    for (std::size_t k = 0; k < fan.size(); ++k) {
        const Vec3 &a = directions_[k], &b = directions_[(k + 1) % fan.size()];
        angle += std::atan2(inward.dot(a.cross(b)), 1 + inward.dot(a) + a.dot(b) + b.dot(inward));
    }
    return angle < kPit;
}

/// Walks the fan of faces around each corner of each wall. A corner has the number of the use that begins there.
void FeatureFinder::addVertices() {
    std::vector<char> seen(partner_.size(), 0);
    std::vector<int> cornersAt(crowded_.size(), 0), fan;
    for (const Corners& c : corners_)
        for (const int v : c) ++cornersAt[v];
    for (int start = 0; start < 3 * int(body_.walls.size()); ++start) {
        pulse_();
        if (seen[start]) continue;
        const int vertex = corners_[start / 3][start % 3];
        fan.clear();
        int corner = start;
        bool buried = false;
        do {
            seen[corner] = 1;
            fan.push_back(corner);
            buried = buried || !isWall(corner / 3);
            corner = partner_[3 * (corner / 3) + (corner % 3 + 2) % 3];
        } while (corner >= 0 && !seen[corner]);
        if (corner != start) {
            out_.dropped.buriedVertices += corner < 0;  // of the walks in an open fan, one reaches its end
        } else if (buried && !crowded_[vertex] && cornersAt[vertex] == int(fan.size())) {
            ++out_.dropped.buriedVertices;  // no other shell meets this one here, so one has the vertex inside
        } else if (!isSupported(vertex, fan)) {
            ++out_.dropped.unsupportedVertices;
        } else {
            out_.vertices.push_back({vertex, int(out_.spokes.size()), int(fan.size())});
            for (const int use : fan) out_.spokes.push_back(endOf(use));
        }
    }
}

SurfaceFeatures FeatureFinder::find() && {
    flipSlivers();
    for (int f = 0; f < int(corners_.size()); ++f) {
        const Triangle t = triangle(f);
        needle_[f] = !isUsable(t) || isThin(t, kNeedle * body_.scale);
        if (!isWall(f)) continue;
        if (needle_[f]) {
            ++out_.dropped.needles;
        } else {
            faceOf_[f] = int(out_.faces.size());
            out_.faces.push_back({corners_[f], (t[1] - t[0]).cross(t[2] - t[0]).normalized()});
        }
    }
    findWedges();
    for (const Wedge& wedge : wedges_) addEdge(wedge);
    addVertices();
    for (const Vec3& p : body_.vertices) out_.points.push_back(p / body_.scale);
    return std::move(out_);
}

}  // namespace

SurfaceFeatures surfaceFeatures(const RepairedMesh& body, const Heartbeat& heartbeat) {
    Pulse pulse(heartbeat);
    return FeatureFinder(body, pulse).find();
}

}  // namespace touchstone
