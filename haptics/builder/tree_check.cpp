#include "haptics/builder/tree_check.hpp"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "haptics/builder/bare_surface.hpp"
#include "haptics/builder/mesh_repair.hpp"
#include "haptics/builder/touching_poses.hpp"

namespace touchstone {
namespace {

// Length of the pieces that separate bare from covered surface, as a share of the diagonal.
constexpr double kFine = 2e-4;
// A surface point this near to a leaf counts as covered when samples are classified; a share of the diagonal.
constexpr double kCoveredGap = 1e-9;
// Step out of a leaf, as a share of its radius, to test whether another leaf contains the point.
constexpr double kNudge = 1e-9;
// Maximum number of overlaps: a constant, and a number for each leaf. About 50 for each leaf are usual.
constexpr std::int64_t kMaxOverlaps = 10'000'000, kMaxOverlapsPerLeaf = 200;
// Accuracy of the largest hollow, as a share of the diagonal.
constexpr double kHollowAccuracy = 5e-3;

using Beat = std::function<void(double)>;

/// Combines the progress of the stages into one fraction. Reports at most every 20 ms inside a stage.
class Stages {
  public:
    explicit Stages(const BuildProgress& callback) : callback_(callback) { report(0); }

    /// Begins a stage that ends at the given fraction of the whole.
    Beat stage(double end) {
        const double begin = std::exchange(end_, end);
        report(begin);
        return [this, begin, end](double done) {
            if (std::chrono::steady_clock::now() - reported_ > std::chrono::milliseconds(20))
                report(begin + done * (end - begin));
        };
    }
    void finish() { report(1); }

  private:
    void report(double fraction) {
        constexpr double kTooEarly = 0.05;  // fraction below which no remaining time is estimated
        reported_ = std::chrono::steady_clock::now();
        const double spent = std::chrono::duration<double>(reported_ - began_).count();
        const double left = fraction < kTooEarly ? -1 : spent * (1 - fraction) / fraction;
        if (callback_ && !callback_({fraction, left})) throw BuildCancelled{};
    }

    const BuildProgress& callback_;
    double end_ = 0;
    std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now(), reported_;
};

/// The body that results from repairing the mesh, in the frame of RepairedMesh.
class Body {
  public:
    explicit Body(const TriangleMesh& source)
        : mesh(repairMesh(source)),
          walls_(pick({FaceRole::Wall, FaceRole::Cap})),
          sheets_(pick({FaceRole::Sheet})),
          wallBvh_(walls_),
          sheetBvh_(sheets_) {
        double extent = 0;
        for (const Triangle& t : mesh.cover)
            for (const Vec3& v : t) extent = std::max(extent, v.cwiseAbs().maxCoeff());
        rounding = 8 * std::numeric_limits<double>::epsilon() * extent;
        if (!pick({FaceRole::Buried}).empty())
            shellBvh_.emplace(pick({FaceRole::Wall, FaceRole::Cap, FaceRole::Buried}));
    }

    const RepairedMesh mesh;
    double rounding = 0;  ///< upper bound on the rounding error of a computed distance

    bool hasVolume() const { return !walls_.empty(); }
    bool inside(const Vec3& p) const {
        return hasVolume() && (shellBvh_ ? *shellBvh_ : wallBvh_).windingNumber(p) >= 0.5;
    }

    struct Nearest {
        double distance;
        Vec3 point;
        Vec3 normal;    ///< not of unit length; zero for a degenerate triangle
        bool oriented;  ///< the normal points out of the body
    };
    Nearest nearest(const Vec3& p) const {
        const TriangleBvh::Hit wall = wallBvh_.closest(p), sheet = sheetBvh_.closest(p, wall.distance);
        const TriangleBvh::Hit& hit = sheet.triangle >= 0 ? sheet : wall;
        const Triangle& t = (sheet.triangle >= 0 ? sheets_ : walls_)[hit.triangle];
        return {hit.distance, hit.point, (t[1] - t[0]).cross(t[2] - t[0]), sheet.triangle < 0};
    }

    /// Distance to the walls for a point inside, minus the distance to the body for a point outside. It is 1-Lipschitz,
    /// so a leaf protrudes at most by its radius - depth.
    double depth(const Vec3& p) const { return inside(p) ? wallBvh_.closest(p).distance : -nearest(p).distance; }

    /// Whether depth(p) >= least. Costs less than depth(), because the search ends early if no triangle is too near.
    bool depthAtLeast(const Vec3& p, double least) const {
        const bool in = inside(p);
        if (least > 0) return in && wallBvh_.closest(p, least).triangle < 0;
        const double bound = std::max(-least * (1 + 4 * std::numeric_limits<double>::epsilon()), 1e-150);
        return in || wallBvh_.closest(p, bound).triangle >= 0 || sheetBvh_.closest(p, bound).triangle >= 0;
    }

  private:
    std::vector<Triangle> pick(std::initializer_list<FaceRole> roles) const {
        std::vector<Triangle> out;
        for (const Face& f : mesh.faces)
            if (std::find(roles.begin(), roles.end(), f.role) != roles.end()) out.push_back(f.corners);
        return out;
    }

    std::vector<Triangle> walls_, sheets_;
    TriangleBvh wallBvh_, sheetBvh_;
    std::optional<TriangleBvh> shellBvh_;  ///< closed shells with their buried faces; empty without buried faces
};

/// The leaves in the frame of the body, smaller by the rounding error of a distance: a point that lies in them by the
/// computed distance lies in the true leaves.
LeafUnion shrunkLeaves(const std::vector<Sphere>& spheres, const Body& body) {
    std::vector<Leaf> leaves;
    for (const Sphere& s : spheres)
        leaves.push_back({Vec3(s.x, s.y, s.z) * body.mesh.scale, s.r * body.mesh.scale - body.rounding});
    return LeafUnion(std::move(leaves));
}

/// Every measurement searches the leaves near a point, and its time is proportional to their number.
void requireFewOverlaps(const LeafUnion& leaves) {
    const auto count = static_cast<std::int64_t>(leaves.leaves().size());
    const std::int64_t limit = kMaxOverlaps + kMaxOverlapsPerLeaf * count;
    if (leaves.overlaps(limit) > limit)
        throw std::invalid_argument("The " + std::to_string(count) + " leaves overlap in more than " +
                                    std::to_string(limit / 2) + " pairs, too many to be measured; thin them out.");
}

/// Low-discrepancy points in the unit cube: multiples of the powers of 1/g, where g^(d+1) = g + 1. Source: M. Roberts,
/// The Unreasonable Effectiveness of Quasirandom Sequences (2018).
template <int d>
Eigen::Matrix<double, d, 1> quasiRandom(int i, std::uint64_t seed) {
    static const double g = [] {
        double x = 1;
        for (int k = 0; k < 60; ++k) x = std::pow(1 + x, 1.0 / (d + 1));
        return x;
    }();
    Eigen::Matrix<double, d, 1> out;
    for (int a = 0; a < d; ++a) {
        const double step = std::pow(g, -(a + 1));
        out[a] = std::fmod(0.5 + static_cast<double>(seed % 4096) * std::numbers::phi + (i + 1) * step, 1.0);
    }
    return out;
}

/// Measures the leaves' outside: protrusion, distance to the surface and normal error.
void measureOutside(const Body& body, const LeafUnion& leaves, const CheckOptions& options, Stages& progress,
                    TreeMetrics& out) {
    double area = 0, squares = 0, angles = 0, angleArea = 0;
    const double coveredGap = kCoveredGap * body.mesh.diagonal;
    const auto addPatch = [&](const OutsidePatch& patch) {
        const Body::Nearest surface = body.nearest(patch.point);
        const bool inside = body.inside(patch.point);
        if (inside && leaves.gap(surface.point) <= coveredGap) return;  // the patch is the wall of a hollow
        const double protrusion = inside ? 0 : surface.distance;
        out.protrusionMax = std::max(out.protrusionMax, protrusion);
        out.hausdorffToSurface = std::max(out.hausdorffToSurface, surface.distance);
        area += patch.area;
        squares += patch.area * protrusion * protrusion;
        if (const double length = surface.normal.norm(); length > 0) {
            const double cosine = surface.normal.dot(patch.normal) / length;
            angleArea += patch.area;
            angles += patch.area * std::acos(std::clamp(surface.oriented ? cosine : std::abs(cosine), -1.0, 1.0));
        }
    };

    // Take the point of each leaf that protrudes most, if no other leaf contains it. It counts with zero area.
    Beat beat = progress.stage(0.2);
    const auto& all = leaves.leaves();
    for (std::size_t i = 0; i < all.size(); ++i) {
        beat(static_cast<double>(i) / static_cast<double>(all.size()));
        const auto& [center, radius] = all[i];
        const Body::Nearest surface = body.nearest(center);
        const bool inside = body.inside(center);
        // A sheet inside the body is no wall, so it does not limit the depth.
        const double depth = !inside ? -surface.distance : surface.oriented ? surface.distance : body.depth(center);
        out.protrusionCertified = std::max(out.protrusionCertified, radius + body.rounding - depth + body.mesh.weld);
        if (!(surface.distance > 0) || radius < 0) continue;
        const Vec3 normal = (inside ? 1.0 : -1.0) * (surface.point - center).normalized();
        if (!leaves.contains(center + (1 + kNudge) * radius * normal)) addPatch({center + radius * normal, normal, 0});
    }

    const std::vector<OutsidePatch> patches = leaves.outside(options.samples, options.seed, progress.stage(0.3));
    beat = progress.stage(0.5);
    for (std::size_t i = 0; i < patches.size(); ++i) {
        beat(static_cast<double>(i) / static_cast<double>(patches.size()));
        addPatch(patches[i]);
    }
    out.protrusionRms = area > 0 ? std::sqrt(squares / area) : 0;
    out.normalErrorMean = angleArea > 0 ? angles / angleArea : 0;
}

/// Distance from p along u to the first point that lies in no leaf; `atMost` if that distance is larger.
double exitDistance(const LeafUnion& leaves, const Vec3& p, const Vec3& u, double atMost) {
    double t = 0;
    for (;;) {
        double next = t;
        leaves.near(p + t * u, 0, [&](int i) {
            const Leaf& s = leaves.leaves()[i];
            const Vec3 off = p - s.center;
            const double along = off.dot(u), left = along * along - off.squaredNorm() + s.radius * s.radius;
            if (left >= 0) next = std::max(next, std::sqrt(left) - along);
        });
        if (next >= atMost) return atMost;
        if (next <= t * (1 + kNudge) + kNudge * kNudge) return next;
        t = next;
    }
}

/// The largest distance from a point of the surface to the leaves' outside, over evenly distributed points. The
/// distance of a point is the shortest way out along the normal. If that might be the largest of all, other directions
/// are searched; the result is at most about 2 % too long where many directions are about equally good.
double farthestFromOutside(const Body& body, const LeafUnion& leaves, const CheckOptions& options, const Beat& beat) {
    constexpr int kDirections = 64, kPolish = 100;  // numbers of first directions and of local search steps
    const auto counts = [](const Face& f) { return f.role == FaceRole::Wall || f.role == FaceRole::Sheet; };
    double total = 0, sum = 0, farthest = 0;
    for (const Face& f : body.mesh.faces) total += counts(f) ? areaOf(f.corners) : 0;
    const auto visit = [&](const Vec3& p, const Vec3& normal, bool wall) {
        if (const double gap = leaves.gap(p); gap > 0) {
            farthest = std::max(farthest, gap);
            return;
        }
        double least = exitDistance(leaves, p, normal, HUGE_VAL);
        Vec3 way = normal;
        const auto attempt = [&](const Vec3& u) {
            const double d = exitDistance(leaves, p, u, least);
            // An exit inside the body leads into a hollow, not to the leaves' outside.
            if (!(d < least) || (wall && body.inside(p + d * u))) return false;
            least = d;
            way = u;
            return true;
        };
        attempt(-normal);
        for (int i = 0; i < kDirections && least > farthest; ++i) {
            const double z = (2 * i + 1.0) / kDirections - 1, turn = 2 * std::numbers::pi * i / std::numbers::phi;
            const double r = std::sqrt(1 - z * z);
            attempt(Vec3(r * std::cos(turn), r * std::sin(turn), z));
        }
        double spread = 0.3;
        for (int step = 0; step < kPolish && least > farthest; ++step) {
            // Creases between leaves are narrow valleys of the distance. A rotating search direction follows them.
            const Vec3 u = way.unitOrthogonal(), v = way.cross(u);
            const double turn = step * 2 * std::numbers::pi / std::numbers::phi;
            const bool better = attempt((way + spread * (std::cos(turn) * u + std::sin(turn) * v)).normalized());
            spread *= better ? 1.5 : 0.9;
        }
        farthest = std::max(farthest, least);
    };
    int drawn = 0;
    for (const Face& f : body.mesh.faces) {
        const auto& [a, b, c] = f.corners;
        const Vec3 normal = (b - a).cross(c - a);
        if (!counts(f) || !(normal.norm() > 0)) continue;
        beat(sum / total);
        sum += areaOf(f.corners);
        visit(a, normal.normalized(), f.role == FaceRole::Wall);
        for (const auto end = static_cast<int>(sum / total * options.samples); drawn < end; ++drawn) {
            Eigen::Vector2d u = quasiRandom<2>(drawn, options.seed);
            if (u.sum() > 1) u = Eigen::Vector2d::Ones() - u;
            visit(a + u[0] * (b - a) + u[1] * (c - a), normal.normalized(), f.role == FaceRole::Wall);
        }
    }
    return farthest;
}

/// Volume of the leaves' union divided by the volume of the body, each from points distributed over its bounding box.
double volumeRatio(const Body& body, const LeafUnion& leaves, const CheckOptions& options, const Beat& beat) {
    if (!body.hasVolume()) return NAN;
    Box bodyBox, leafBox;
    for (const Triangle& t : body.mesh.cover)
        for (const Vec3& v : t) bodyBox.add(v);
    for (const Leaf& s : leaves.leaves()) {
        leafBox.add(s.center - Vec3::Constant(s.radius));
        leafBox.add(s.center + Vec3::Constant(s.radius));
    }
    int inLeaves = 0, inBody = 0;
    for (int i = 0; i < options.samples; ++i) {
        beat(static_cast<double>(i) / options.samples);
        const Vec3 at = quasiRandom<3>(i, options.seed);
        inLeaves += leaves.contains(leafBox.lo + at.cwiseProduct(leafBox.hi - leafBox.lo));
        inBody += body.inside(bodyBox.lo + at.cwiseProduct(bodyBox.hi - bodyBox.lo));
    }
    return inBody > 0 ? inLeaves * (leafBox.hi - leafBox.lo).prod() / (inBody * (bodyBox.hi - bodyBox.lo).prod()) : NAN;
}

/// Radius of the largest ball inside the body and clear of all leaves, within `slack`; `above` if no such ball is
/// larger than `above` by more than `slack`. The largest ball at p has the radius min(depth(p), gap(p)), which is
/// 1-Lipschitz. A cube that cannot contain a larger one is skipped; other cubes are divided into eight.
double largestHollow(const Body& body, const LeafUnion& leaves, double above, double slack, const Beat& beat) {
    struct Cube {
        Vec3 center;
        double half;
    };
    if (!body.hasVolume()) return above;
    Box box;
    for (const Triangle& t : body.mesh.cover)
        for (const Vec3& v : t) box.add(v);
    double largest = above;
    std::vector<Cube> waiting{{box.center(), 0.5 * (box.hi - box.lo).maxCoeff()}};
    while (!waiting.empty()) {
        const Vec3 center = waiting.back().center;
        const double half = waiting.back().half;
        waiting.pop_back();
        beat(0);
        const double reach = std::sqrt(3.0) * half, enough = largest + slack;
        bool tooSmall = false;
        leaves.near(center, std::max(0.0, enough - reach), [&](int i) {
            const Leaf& s = leaves.leaves()[i];
            tooSmall = tooSmall || (s.center - center).norm() - s.radius + reach <= enough;
        });
        if (tooSmall || !body.depthAtLeast(center, enough - reach)) continue;
        if (const double gap = leaves.gap(center); gap > largest && body.depthAtLeast(center, largest))
            largest = std::max(largest, std::min(gap, body.depth(center)));
        for (int octant = 0; octant < 8; ++octant) {
            const auto sign = [&](int a) { return octant >> a & 1 ? 0.5 : -0.5; };
            waiting.push_back({center + half * Vec3(sign(0), sign(1), sign(2)), 0.5 * half});
        }
    }
    return largest;
}

void measureContainment(const SphereHierarchy& hierarchy, TreeMetrics& out) {
    constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();
    for (const SphereNode& leaf : hierarchy.nodes) {
        if (leaf.children > 0) continue;
        double escape = 0;
        for (int n = leaf.parent; n >= 0; n = hierarchy.nodes[n].parent) {
            const SphereNode& node = hierarchy.nodes[n];
            const double beyond = (leaf.center - node.center).norm() + leaf.radius - node.radius;
            if (beyond > kRounding * (node.radius + leaf.center.norm())) escape = std::max(escape, beyond);
        }
        out.leavesOutside += escape > 0;
        out.largestEscape = std::max(out.largestEscape, escape);
    }
}

TreeMetrics measure(const SphereHierarchy& hierarchy, const SphereTree* tree, const TriangleMesh& mesh,
                    const CheckOptions& options, const BuildProgress& report) {
    Stages progress(report);
    const Body body(mesh);
    const std::vector<Sphere> spheres = hierarchy.leaves();
    const LeafUnion leaves = shrunkLeaves(spheres, body);
    requireFewOverlaps(leaves);
    TreeMetrics out;
    out.leaves = static_cast<int>(spheres.size());
    out.nodes = static_cast<int>(hierarchy.nodes.size());

    const BareSurface bare =
        findBareSurface(body.mesh.cover, leaves, kFine * body.mesh.diagonal, false, progress.stage(0.1));
    double area = 0;
    for (const Triangle& t : body.mesh.cover) area += areaOf(t);
    out.coverageProven = bare.covered;
    out.uncoveredShare = bare.area / area;
    out.largestGap = bare.largestGap;

    measureOutside(body, leaves, options, progress, out);
    out.hausdorffToTree = farthestFromOutside(body, leaves, options, progress.stage(0.7));
    out.volumeRatio = volumeRatio(body, leaves, options, progress.stage(0.8));
    out.hollow = largestHollow(body, leaves, 0, kHollowAccuracy * body.mesh.diagonal, progress.stage(0.85));
    measureContainment(hierarchy, out);

    // Convert the lengths from the frame of the repaired mesh to mm.
    const double mm = 1 / body.mesh.scale;
    out.diagonal = body.mesh.diagonal;
    for (double* length : {&out.diagonal, &out.largestGap, &out.protrusionMax, &out.protrusionRms,
                           &out.protrusionCertified, &out.hollow, &out.hausdorffToTree, &out.hausdorffToSurface})
        *length *= mm;

    const PoseFigures figures =
        measurePoses(hierarchy, tree, out.diagonal, options.poses, options.seed, progress.stage(1));
    out.poses = figures.poses;
    out.testsPerPose = figures.testsPerPose;
    out.pairsPerPose = figures.pairsPerPose;
    out.pairsMissed = figures.pairsMissed;
    out.pressedPairsPerPose = figures.pressedPairsPerPose;
    out.pressedPairsMissed = figures.pressedPairsMissed;
    out.walkUs = figures.walkUs;
    progress.finish();
    return out;
}

template <class... Parts>
std::string sentence(const Parts&... parts) {
    std::ostringstream out;
    out.precision(9);
    (out << ... << parts);
    return out.str();
}

std::string at(const Vec3& p) { return sentence("(", p.x(), ", ", p.y(), ", ", p.z(), ") mm"); }

/// Checks that every leaf lies in every block above it, both in its sphere and in its rounded box. Walks prune by
/// these. Returns a sentence about the first leaf that does not; empty if all do.
std::string refuteBlocks(const SphereTree& tree) {
    const auto inSphere = [](const Sphere& leaf, const Sphere& block) {
        const Vec3 off = Vec3(leaf.x, leaf.y, leaf.z) - Vec3(block.x, block.y, block.z);
        return off.norm() + leaf.r <= block.r * (1 + 4 * std::numeric_limits<double>::epsilon());
    };
    int size = 1;
    for (int k = 1; k < static_cast<int>(tree.levels.size()); ++k) {
        size *= SphereTree::kBranching;
        const TreeLevel& level = tree.levels[k];
        for (int i = 0; i < tree.leafCount(); ++i) {
            const Sphere leaf = tree.leaf(i);
            const int b = i / size;
            assert(b < level.count);
            // The rounded box contains the leaf if the inner box contains the leaf shrunk by the rounding.
            const double rest = double(leaf.r) - double(level.round[b]);
            bool inside = inSphere(leaf, tree.block(k, b)) && level.round[b] <= leaf.r;
            const std::array<double, 3> c{leaf.x, leaf.y, leaf.z};
            for (int a = 0; a < 3; ++a)
                inside = inside && level.lo[a][b] <= c[a] - rest && c[a] + rest <= level.hi[a][b];
            if (!inside)
                return sentence("Leaf ", i, " of the sphere tree sticks out of its ancestor ", b, " of level ", k, ".");
        }
    }
    return {};
}

}  // namespace

TreeMetrics measureTree(const SphereHierarchy& hierarchy, const TriangleMesh& mesh, const CheckOptions& options,
                        const BuildProgress& progress) {
    return measure(hierarchy, nullptr, mesh, options, progress);
}

TreeMetrics measureTree(const SphereTree& tree, const TriangleMesh& mesh, const CheckOptions& options,
                        const BuildProgress& progress) {
    return measure(hierarchyOf(tree), &tree, mesh, options, progress);
}

std::string refuteCertificate(const SphereTree& tree, const TriangleMesh& mesh) {
    if (std::string escape = refuteBlocks(tree); !escape.empty()) return escape;
    const TreeCertificate& claimed = tree.certificate;
    const Body body(mesh);
    const double mm = 1 / body.mesh.scale;
    if (!(std::abs(claimed.diagonal - body.mesh.diagonal * mm) <= 1e-12 * claimed.diagonal))
        return sentence("The mesh's diagonal is ", body.mesh.diagonal * mm, " mm, not ", claimed.diagonal,
                        " mm as the sphere tree's certificate says.");
    if (claimed.closed && !body.mesh.closed())
        return "The mesh does not bound a volume, though the sphere tree's certificate says so.";

    std::vector<Sphere> spheres;
    for (int i = 0; i < tree.leafCount(); ++i) spheres.push_back(tree.leaf(i));
    if (!std::isfinite(claimed.protrusion)) return "The sphere tree's certificate states no protrusion.";
    const double allowed = claimed.protrusion * body.mesh.scale - body.mesh.weld;
    for (int i = 0; i < tree.leafCount(); ++i) {
        const Vec3 center = Vec3(spheres[i].x, spheres[i].y, spheres[i].z) * body.mesh.scale;
        const double radius = spheres[i].r * body.mesh.scale;
        if (!body.depthAtLeast(center, radius - allowed))
            return sentence(
                "Leaf ", i, " of the sphere tree may reach ", (radius - body.depth(center) + body.mesh.weld) * mm,
                " mm out of the surface, more than the ", claimed.protrusion, " mm that its certificate says.");
    }
    const LeafUnion leaves = shrunkLeaves(spheres, body);
    const Beat silent = [](double) {};
    if (claimed.covered)
        if (const BareSurface bare = findBareSurface(body.mesh.cover, leaves, 0, true, silent); !bare.covered)
            return sentence("The surface at ", at(bare.where * mm),
                            " lies in no leaf of the sphere tree, though its certificate says that all of it does.");
    if (claimed.hollow >= 0) {
        const double limit = claimed.hollow * body.mesh.scale;
        const double hollow = largestHollow(body, leaves, limit, kHollowAccuracy * body.mesh.diagonal, silent);
        if (hollow > limit)
            return sentence("A ball of radius ", hollow * mm,
                            " mm fits between the leaves of the sphere tree, more than the ", claimed.hollow,
                            " mm that its certificate says.");
    }
    return {};
}

}  // namespace touchstone
