#include "haptics/builder/tree_check.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <set>
#include <stdexcept>

#include "haptics/builder/bare_surface.hpp"
#include "haptics/builder/leaf_union.hpp"
#include "haptics/builder/touching_poses.hpp"
#include "haptics/collision/tree_walk.hpp"
#include "tests/support/test_meshes.hpp"

namespace touchstone::tree_check_tests {
namespace {

const CheckOptions kQuick{.samples = 20000, .poses = 4, .seed = 1};
const std::function<void(double)> kSilent = [](double) {};

/// A root around the given leaves.
SphereHierarchy flat(const std::vector<Sphere>& leaves) {
    SphereHierarchy h;
    h.branching = static_cast<int>(leaves.size());
    h.nodes.push_back({Vec3::Zero(), 0, -1, 1, h.branching});
    for (const Sphere& s : leaves) {
        h.nodes.push_back({Vec3(s.x, s.y, s.z), s.r, 0});
        h.nodes[0].radius = std::max(h.nodes[0].radius, h.nodes.back().center.norm() + s.r);
    }
    return h;
}

TriangleMesh squareMesh(double side) {
    TriangleMesh m;
    m.vertices = {Vec3(0, 0, 0), Vec3(side, 0, 0), Vec3(side, side, 0), Vec3(0, side, 0)};
    m.triangles = {{0, 1, 2}, {0, 2, 3}};
    return m;
}

/// Spheres about the points of a grid of step 1 over the square [0, side]^2, without the one at `hole`.
std::vector<Sphere> gridLeaves(int side, float radius, int holeX = -1, int holeY = -1) {
    std::vector<Sphere> out;
    for (int x = 0; x <= side; ++x)
        for (int y = 0; y <= side; ++y)
            if (x != holeX || y != holeY) out.push_back({float(x), float(y), 0, radius});
    return out;
}

/// Outward distance from a cube about the origin, and the normal of the side next to p.
double outOfCube(const Vec3& p, double half, Vec3& normal) {
    const Vec3 on = p.cwiseMax(-half).cwiseMin(half);
    int side = 0;
    on.cwiseAbs().maxCoeff(&side);
    normal = Vec3::Unit(side) * (p[side] < 0 ? -1 : 1);
    return (p - on).norm();
}

TEST_CASE("tree check: thousands of coincident leaves are refused, a few are accepted", "[tree]") {
    const std::vector<Sphere> same(100000, Sphere{0.5f, 0.5f, 0, 1}), few(100, same[0]);
    CHECK_THROWS_WITH(measureTree(flat(same), squareMesh(1), kQuick), Catch::Contains("100000 leaves overlap"));
    CHECK(measureTree(flat(few), squareMesh(1), {.samples = 1000, .poses = 0}).coverageProven);
    std::vector<Sphere> near;
    for (int i = 0; i < 300; ++i) near.push_back({0.5f + 1e-6f * float(i), 0.5f, 0, 1});
    CHECK_THROWS_WITH(measureTree(flat(near), squareMesh(1), {.samples = 20000, .poses = 0}),
                      Catch::Contains("nearly coincide"));
}

TEST_CASE("tree check: one sphere around a cube", "[tree]") {
    // Half side 1. The sphere passes just outside the corners, sqrt(3) from the center.
    const double r = std::sqrt(3.0) + 1e-6;
    const TriangleMesh cube = test::boxMesh(Vec3(2, 2, 2), Vec3(-1, -1, -1));
    const TreeMetrics m = measureTree(flat({{0, 0, 0, float(r)}}), cube, {.samples = 100000, .poses = 2});
    CHECK(m.leaves == 1);
    CHECK(m.nodes == 2);
    CHECK(m.diagonal == Approx(2 * std::sqrt(3.0)));
    CHECK(m.coverageProven);
    CHECK(m.uncoveredShare == 0);
    CHECK(m.largestGap == 0);
    // The largest distance is above the center of a side.
    CHECK(m.protrusionMax == Approx(r - 1).epsilon(1e-6));
    CHECK(m.protrusionCertified == Approx(r - 1).epsilon(1e-6));
    CHECK(m.hausdorffToSurface == Approx(r - 1).epsilon(1e-6));
    CHECK(m.hausdorffToTree == Approx(r - 1).epsilon(1e-3));  // sampled: 1e5 points on 24 square mm lie 0.01 apart
    CHECK(m.volumeRatio == Approx(4 * M_PI / 3 * r * r * r / 8).epsilon(2e-3));  // random points: 3e-3
    // Reference: random points of the sphere and their exact distance from the cube.
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    double squares = 0, angles = 0;
    constexpr int kPoints = 200000;
    for (int i = 0; i < kPoints; ++i) {
        const Vec3 u = Vec3(normal(random), normal(random), normal(random)).normalized();
        Vec3 side;
        const double d = outOfCube(r * u, 1, side);
        squares += d * d;
        angles += std::acos(u.dot(side));
    }
    CHECK(m.protrusionRms == Approx(std::sqrt(squares / kPoints)).epsilon(5e-3));  // error of the reference: 1/447
    CHECK(m.normalErrorMean == Approx(angles / kPoints).epsilon(2e-2));  // beyond an edge either side may be nearest
    CHECK(m.leavesOutside == 0);
    CHECK(m.poses == 2);
    CHECK(m.pairsPerPose == 1);
    CHECK(m.testsPerPose == 3);  // root and root, leaf and root, leaf and leaf
    CHECK(m.pairsMissed == 0);
    CHECK(m.walkUs == -1);
}

TEST_CASE("tree check: a leaf pushed outward raises the protrusion by the push", "[tree]") {
    // The inscribed ball and a ball of radius 1 that touches the side x = 10 from inside: neither protrudes.
    const TriangleMesh box = test::boxMesh(Vec3(10, 10, 10));
    for (const float push : {0.0f, 0.25f, 0.5f, 3.0f}) {
        const TreeMetrics m = measureTree(flat({{5, 5, 5, 5}, {9 + push, 5, 5, 1}}), box, kQuick);
        CHECK(m.protrusionMax == Approx(push).margin(1e-6));
        CHECK(m.protrusionCertified == Approx(push).margin(1e-6));
        CHECK_FALSE(m.coverageProven);
        // The corners are farthest from the inscribed ball.
        CHECK(m.largestGap == Approx(5 * std::sqrt(3.0) - 5).epsilon(2e-3));
    }
}

TEST_CASE("tree check: finds a planted gap and its size", "[tree]") {
    const TriangleMesh square = squareMesh(10);
    const TreeMetrics whole = measureTree(flat(gridLeaves(10, 0.75f)), square, kQuick);
    CHECK(whole.coverageProven);
    CHECK(whole.uncoveredShare == 0);
    CHECK(std::isnan(whole.volumeRatio));
    CHECK(whole.protrusionCertified == Approx(0.75).epsilon(1e-14));  // a sheet: every center lies on it

    const TreeMetrics m = measureTree(flat(gridLeaves(10, 0.75f, 4, 6)), square, kQuick);
    CHECK_FALSE(m.coverageProven);
    CHECK(m.largestGap == Approx(0.25).epsilon(2e-3));  // the center of the hole is 1 away from its neighbors' centers
    int bare = 0;
    constexpr int kGrid = 1000;
    for (int i = 0; i < kGrid; ++i)
        for (int j = 0; j < kGrid; ++j) {
            const double x = (i + 0.5) / kGrid - 0.5, y = (j + 0.5) / kGrid - 0.5;
            bare += std::hypot(1 - std::abs(x), y) > 0.75 && std::hypot(x, 1 - std::abs(y)) > 0.75;
        }
    CHECK(m.uncoveredShare == Approx(0.01 * bare / kGrid / kGrid).epsilon(5e-3));  // pieces of 2e-4 of the diagonal
}

TEST_CASE("tree check: refuses gaps of any size, and nothing else", "[tree]") {
    const TriangleMesh square = squareMesh(10);
    const auto refuted = [&](const std::vector<Sphere>& leaves) {
        TreeCertificate claimed;
        claimed.protrusion = 1;
        claimed.diagonal = 10 * std::sqrt(2.0);
        claimed.covered = true;
        return refuteCertificate(makeSphereTree(leaves, claimed), square);
    };
    CHECK(refuted(gridLeaves(10, 0.75f)).empty());
    const std::string hole = refuted(gridLeaves(10, 0.75f, 4, 6));
    CHECK(hole.find("lies in no leaf") != hole.npos);
    CHECK(hole.find("mm") != hole.npos);
    // Four spheres meet at the centers of the grid's squares, sqrt(1/2) away.
    const double reach = std::sqrt(0.5);
    for (const double spare : {1e-1, 1e-3, 1e-6}) CHECK(refuted(gridLeaves(10, float(reach + spare))).empty());
    for (const double gap : {1e-1, 1e-3, 1e-6}) CHECK_FALSE(refuted(gridLeaves(10, float(reach - gap))).empty());
    // Leaves beside the sheet cover slightly less of it.
    auto lifted = gridLeaves(10, float(reach + 1e-3));
    for (Sphere& s : lifted) s.z = 0.05f;
    CHECK_FALSE(refuted(lifted).empty());
    // A claim that is not made is not refuted.
    TreeCertificate modest;
    modest.protrusion = 1;
    modest.diagonal = 10 * std::sqrt(2.0);
    CHECK(refuteCertificate(makeSphereTree(gridLeaves(10, 0.75f, 4, 6), modest), square).empty());
}

TEST_CASE("tree check: every claim of a certificate is compared with the tree", "[tree]") {
    const TriangleMesh blob = test::blobMesh(20);
    const SphereTree good = buildSphereTree(blob, {.leaves = 100});
    REQUIRE(refuteCertificate(good, blob).empty());
    const auto says = [&](const auto& spoil, const char* what) {
        SphereTree bad = good;
        spoil(bad);
        const std::string why = refuteCertificate(bad, blob);
        INFO(why);
        CHECK(why.find(what) != why.npos);
        CHECK(std::count(why.begin(), why.end(), '\n') == 0);
    };
    says([](SphereTree& t) { t.certificate.protrusion *= 0.999; }, "may reach");
    says([](SphereTree& t) { t.certificate.protrusion = 0; }, "may reach");
    says([](SphereTree& t) { t.certificate.protrusion = -1; }, "may reach");
    says([](SphereTree& t) { t.certificate.protrusion = NAN; }, "no protrusion");
    says([](SphereTree& t) { t.certificate.diagonal *= 1.01; }, "diagonal");
    says([](SphereTree& t) { t.certificate.diagonal = NAN; }, "diagonal");
    says([](SphereTree& t) { t.levels[1].r[3] *= 0.9f; }, "sticks out of its ancestor 3 of level 1");
    says([](SphereTree& t) { t.levels.back().r[0] *= 0.9f; }, "sticks out");
    says([](SphereTree& t) { t.levels[1].lo[1][2] += 1; }, "sticks out");
    says([](SphereTree& t) { t.levels[2].round[0] *= 2.0f; }, "sticks out");
    says([](SphereTree& t) { t.levels[0].r[50] = NAN; }, "sticks out");
    // Every leaf is necessary: without any one of them the surface is bare somewhere.
    std::vector<Sphere> fewer;
    for (int i = 0; i < good.leafCount(); ++i)
        if (i != 42) fewer.push_back(good.leaf(i));
    CHECK(refuteCertificate(makeSphereTree(fewer, good.certificate), blob).find("lies in no leaf") !=
          std::string::npos);

    TriangleMesh open = test::boxMesh(Vec3(10, 10, 10));
    open.triangles.resize(10);
    SphereTree tree = buildSphereTree(open, {.leaves = 50});
    REQUIRE(refuteCertificate(tree, open).empty());
    tree.certificate.closed = true;
    CHECK(refuteCertificate(tree, open).find("bound a volume") != std::string::npos);
}

TEST_CASE("tree check: a shrunken parent does not contain its leaves, and walks miss pairs", "[tree]") {
    const TriangleMesh blob = test::blobMesh(20);
    const SphereTree tree = buildSphereTree(blob, {.leaves = 100});
    SphereHierarchy h = hierarchyOf(tree);
    CheckOptions options = kQuick;
    options.poses = 32;
    const TreeMetrics sound = measureTree(h, blob, options);
    CHECK(sound.leavesOutside == 0);
    CHECK(sound.largestEscape == 0);
    CHECK(sound.pairsMissed == 0);
    CHECK(sound.pressedPairsMissed == 0);
    CHECK(sound.pressedPairsPerPose > sound.pairsPerPose);

    // One bucket becomes a point: all its leaves protrude, by the distance to their far ends.
    SphereNode& bucket = h.nodes[h.nodes[1].firstChild];
    double far = 0;
    for (int k = 0; k < bucket.children; ++k) {
        const SphereNode& leaf = h.nodes[bucket.firstChild + k];
        far = std::max(far, (leaf.center - bucket.center).norm() + leaf.radius);
    }
    const int inBucket = bucket.children;
    bucket.radius = 0;
    const TreeMetrics one = measureTree(h, blob, options);
    CHECK(one.leavesOutside == inBucket);
    CHECK(one.largestEscape == Approx(far));

    for (SphereNode& node : h.nodes)
        if (node.children > 0 && node.parent >= 0) node.radius *= 0.3;
    const TreeMetrics all = measureTree(h, blob, options);
    CHECK(all.pairsMissed > 0);
    CHECK(all.pressedPairsMissed > 0);
    CHECK(static_cast<double>(all.pairsMissed) <= all.pairsPerPose * all.poses);
}

TEST_CASE("tree check: the walls of a hollow do not count as outside", "[tree]") {
    // A box of 10 under a crust of balls about its surface points: the hollow inside starts 1.2 below the surface.
    const TriangleMesh box = test::boxMesh(Vec3(10, 10, 10));
    std::vector<Sphere> crust;
    for (int x = 0; x <= 10; ++x)
        for (int y = 0; y <= 10; ++y)
            for (int z = 0; z <= 10; ++z)
                if (x % 10 == 0 || y % 10 == 0 || z % 10 == 0) crust.push_back({float(x), float(y), float(z), 1.2f});
    const TreeMetrics m = measureTree(flat(crust), box, kQuick);
    CHECK(m.coverageProven);
    CHECK(m.protrusionMax == Approx(1.2).epsilon(1e-6));
    CHECK(m.hausdorffToSurface == Approx(1.2).epsilon(1e-6));
    // Above the center of four balls the outside is sqrt(1.2^2 - 1/2) away; this smallest height bounds the RMS from
    // below.
    CHECK(m.protrusionRms > std::sqrt(1.2 * 1.2 - 0.5));
    CHECK(m.protrusionRms < 1.2);
    CHECK(m.volumeRatio < 12.4 * 12.4 * 12.4 / 1000);
    // The largest ball in the center reaches the balls on the sides: 5 - 1.2.
    CHECK(m.hollow == Approx(3.8).margin(0.005 * m.diagonal));
    TreeCertificate claimed;
    claimed.protrusion = 1.3;
    claimed.diagonal = m.diagonal;
    claimed.covered = claimed.closed = true;
    for (const double hollow : {-1.0, 3.8, 5.0}) {
        claimed.hollow = hollow;
        CHECK(refuteCertificate(makeSphereTree(crust, claimed), box).empty());
    }
    for (const double hollow : {0.0, 1.0, 3.7}) {
        claimed.hollow = hollow;
        CHECK(refuteCertificate(makeSphereTree(crust, claimed), box).find("fits between the leaves") !=
              std::string::npos);
    }
    const auto filled = [&] {
        auto all = crust;
        all.push_back({5, 5, 5, 6.9f});  // reaches the corners of the hollow, 3.8·sqrt(3) away
        claimed.protrusion = 2;
        claimed.hollow = 0;
        return makeSphereTree(all, claimed);
    }();
    CHECK(refuteCertificate(filled, box).empty());
    // With an opening, the floor of the hollow belongs to the outside: the nearest surface there is bare.
    std::erase_if(crust, [](const Sphere& s) { return s.x == 10 && std::abs(s.y - 5) < 3 && std::abs(s.z - 5) < 3; });
    CHECK_FALSE(measureTree(flat(crust), box, kQuick).coverageProven);
}

TEST_CASE("tree check: the distance to the outside includes the creases between leaves", "[tree]") {
    // Two unit balls, 0.8 from a tiny part at the origin: their circle of intersection has radius 0.6.
    constexpr double kPartSize = 0.01;
    const TriangleMesh crumb = test::boxMesh(Vec3::Constant(kPartSize), Vec3::Constant(-0.5 * kPartSize));
    const TreeMetrics m = measureTree(flat({{-0.8f, 0, 0, 1}, {0.8f, 0, 0, 1}}), crumb, kQuick);
    CHECK(m.coverageProven);
    // The centers of the sides normal to the axis are furthest from the circle. The search comes within 2 %.
    CHECK(m.hausdorffToTree >= std::hypot(0.6, 0.5 * kPartSize) - 1e-5);
    CHECK(m.hausdorffToTree < 0.612);
    CHECK(m.hausdorffToSurface == Approx(1.8).margin(kPartSize));
    CHECK(m.protrusionMax == Approx(1.8).margin(kPartSize));
}

TEST_CASE("tree check: progress rises to one, and its callback can cancel the check", "[tree]") {
    const TriangleMesh blob = test::blobMesh(20);
    const SphereTree tree = buildSphereTree(blob, {.leaves = 60});
    double before = 0;
    bool rising = true;
    measureTree(tree, blob, kQuick, [&](const BuildStatus& status) {
        rising = rising && status.fraction >= before && status.fraction <= 1;
        before = status.fraction;
        return true;
    });
    CHECK(rising);
    CHECK(before == 1);
    for (int allowed = 0; allowed < 6; ++allowed) {
        int calls = 0;
        CHECK_THROWS_AS(measureTree(tree, blob, kQuick, [&](const BuildStatus&) { return calls++ < allowed; }),
                        BuildCancelled);
        CHECK(calls == allowed + 1);
    }
    TriangleMesh line;
    line.vertices = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(2, 0, 0)};
    line.triangles = {{0, 1, 2}};
    CHECK_THROWS_AS(measureTree(tree, line), std::invalid_argument);
    CHECK_THROWS_AS(refuteCertificate(tree, line), std::invalid_argument);
}

TEST_CASE("tree check: the same tree gives the same figures", "[tree]") {
    const TriangleMesh blob = test::blobMesh(20);
    const SphereTree tree = buildSphereTree(blob, {.leaves = 60});
    const TreeMetrics a = measureTree(tree, blob, kQuick), b = measureTree(tree, blob, kQuick);
    CHECK(a.protrusionMax == b.protrusionMax);
    CHECK(a.protrusionRms == b.protrusionRms);
    CHECK(a.volumeRatio == b.volumeRatio);
    CHECK(a.hausdorffToTree == b.hausdorffToTree);
    CHECK(a.normalErrorMean == b.normalErrorMean);
    CHECK(a.testsPerPose == b.testsPerPose);
#ifndef _WIN32  // which counts a thread's time in steps that are longer than the walks
    CHECK(a.walkUs > 0);
#endif
    // Another random seed gives other samples and poses, and similar figures.
    CheckOptions other = kQuick;
    other.seed = 2;
    const TreeMetrics c = measureTree(tree, blob, other);
    CHECK(c.protrusionRms != a.protrusionRms);
    CHECK(c.protrusionRms == Approx(a.protrusionRms).epsilon(0.02));  // three times 1/sqrt(20,000)
    CHECK(c.volumeRatio == Approx(a.volumeRatio).epsilon(0.02));
}

TEST_CASE("leaf union: outside areas are those of intersecting spheres", "[tree]") {
    const auto areaOf = [](const LeafUnion& u) {
        double sum = 0;
        for (const OutsidePatch& p : u.outside(20000, 5, kSilent)) {
            CHECK_FALSE(u.contains(p.point + 1e-6 * p.normal));
            sum += p.area;
        }
        return sum;
    };
    CHECK(areaOf(LeafUnion({{Vec3(1, 2, 3), 2}})) == Approx(16 * M_PI));
    // Equal balls count once; a ball inside another and a ball of zero radius do not count.
    CHECK(areaOf(LeafUnion({{Vec3(1, 2, 3), 2}, {Vec3(1, 2, 3), 2}, {Vec3(1, 2, 3.5), 1}, {Vec3(9, 9, 9), -1}})) ==
          Approx(16 * M_PI));
    // Two unit balls 1 apart lose a cap of height 1/2 each. Patches on the rim count completely or not at all.
    CHECK(areaOf(LeafUnion({{Vec3(0, 0, 0), 1}, {Vec3(1, 0, 0), 1}})) == Approx(2 * 2 * M_PI * 1.5).epsilon(1e-3));
}

TEST_CASE("leaf union: point queries agree with a test of all leaves", "[tree]") {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto point = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
    std::vector<Leaf> leaves;
    for (int i = 0; i < 300; ++i) leaves.push_back({point(), 0.1 * uniform(random)});
    const LeafUnion all(leaves);
    int inside = 0;
    for (int i = 0; i < 2000; ++i) {
        const Vec3 p = 1.2 * point();
        double gap = HUGE_VAL;
        std::set<int> near;
        for (int k = 0; k < 300; ++k) {
            if (leaves[k].radius < 0) continue;
            const double d = (p - leaves[k].center).norm() - leaves[k].radius;
            gap = std::min(gap, std::max(0.0, d));
            if (d <= 0.1) near.insert(k);
        }
        inside += gap == 0;
        CHECK(all.contains(p) == (gap == 0));
        CHECK(all.gap(p) == Approx(gap).margin(1e-15));
        std::set<int> found;
        all.near(p, 0.1, [&](int k) { found.insert(k); });
        CHECK(found == near);
    }
    CHECK(inside > 10);
}

TEST_CASE("touching poses: the last contact is the latest of all leaf pairs", "[tree]") {
    std::mt19937 random(12);
    std::normal_distribution<double> normal;
    const auto vector = [&] { return Vec3(normal(random), normal(random), normal(random)); };
    for (int round = 0; round < 40; ++round) {
        std::vector<SphereNode> a, b;
        for (int i = 0; i < 5 + 7 * round; ++i) a.push_back({vector(), 0.1 + 0.1 * std::abs(normal(random))});
        for (int i = 0; i < 200 - 4 * round; ++i) b.push_back({vector(), 0.1 + 0.1 * std::abs(normal(random))});
        const Pose X{0.3 * vector(), expRotation(vector())};
        const Vec3 d = vector().normalized();
        double latest = -HUGE_VAL;
        for (const SphereNode& s : a)
            for (const SphereNode& t : b) {
                const Vec3 off = t.center - X * s.center;
                const double reach = s.radius + t.radius, left = reach * reach - off.cross(d).squaredNorm();
                if (left >= 0) latest = std::max(latest, off.dot(d) + std::sqrt(left));
            }
        INFO("round " << round);
        CHECK(lastContact(a, b, X, d) == Approx(latest).margin(1e-12));
    }
    const std::vector<SphereNode> ball{{Vec3::Zero(), 1}};
    CHECK(lastContact(ball, ball, {Vec3(3, 0, 0)}, Vec3::UnitY()) == -HUGE_VAL);
    CHECK(lastContact(ball, ball, {Vec3(0, 0, 0)}, Vec3::UnitY()) == 2);
}

/// Every pair of leaves with a gap of at most `margin`, by testing all pairs.
std::vector<std::pair<int, int>> brutePairs(const SphereTree& a, const SphereTree& b, const Pose& X, double margin) {
    std::vector<std::pair<int, int>> out;
    for (int i = 0; i < a.leafCount(); ++i) {
        const Sphere s = a.leaf(i);
        const Vec3 c = X * Vec3(s.x, s.y, s.z);
        for (int j = 0; j < b.leafCount(); ++j) {
            const Sphere t = b.leaf(j);
            if ((c - Vec3(t.x, t.y, t.z)).norm() <= double(s.r) + double(t.r) + margin) out.emplace_back(i, j);
        }
    }
    return out;
}

TEST_CASE("trees of random meshes: certificates hold and walks find exactly the pairs of brute force",
          "[tree][slow][long]") {
    const unsigned seed = 13;
    INFO("seed " << seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    const auto vector = [&] { return Vec3(normal(random), normal(random), normal(random)); };
    const auto randomMesh = [&](int kind) {
        switch (kind % 4) {
            case 0:
                return test::blobMesh(5 + 20 * uniform(random));
            case 1:
                return test::torusMesh(10, 1 + 5 * uniform(random));
            case 2:
                return test::joined(test::blobMesh(12), test::moved(test::torusMesh(10, 3), 1, 8 * vector()));
            default:
                return test::joined(test::boxMesh(Vec3(20, 10, 5)), test::moved(test::blobMesh(6), 1, 5 * vector()));
        }
    };
    std::vector<SphereTree> trees;
    for (int kind = 0; kind < 8; ++kind) {
        INFO("kind " << kind);
        const TriangleMesh mesh = randomMesh(kind);
        trees.push_back(buildSphereTree(mesh, {.leaves = 30 + 15 * kind}));
        const TreeCertificate& claimed = trees.back().certificate;
        CHECK(refuteCertificate(trees.back(), mesh).empty());
        const TreeMetrics m = measureTree(trees.back(), mesh, {.samples = 3000, .poses = 6, .seed = seed});
        CHECK(m.coverageProven == claimed.covered);
        CHECK(m.uncoveredShare == 0);
        CHECK(m.protrusionMax <= m.protrusionCertified * (1 + 1e-12));
        CHECK(m.protrusionCertified <= claimed.protrusion);
        CHECK(m.protrusionMax > 0.8 * claimed.protrusion);  // the bound is tight
        CHECK(m.leavesOutside == 0);
        CHECK(m.poses == 6);
        CHECK(m.pairsPerPose >= 1);
        CHECK(m.pairsMissed == 0);
        CHECK(m.pressedPairsMissed == 0);
        CHECK(m.volumeRatio > 1);
        CHECK(m.hausdorffToTree > 0.5 * m.protrusionRms);
    }
    int pairs = 0;
    for (int round = 0; round < 60; ++round) {
        const SphereTree &a = trees[round % 8], &b = trees[(round / 8 + round) % 8];
        Pose X{0.3 * b.certificate.diagonal * vector(), expRotation(2 * vector())};
        X.p += b.center() - X.q * a.center();
        const double margin = round % 3 == 0 ? 0 : 0.1 * (round % 3);
        const auto all = brutePairs(a, b, X, margin);
        TreeWalk walk(a, b);
        std::vector<std::pair<int, int>> found;
        walk.run({X, margin}, [&](const PairEntry* buckets, int count) {
            for (int k = 0; k < count; ++k)
                for (int j = 8 * buckets[k].obstacle; j < std::min(8 * buckets[k].obstacle + 8, b.leafCount()); ++j) {
                    const Sphere s = a.leaf(buckets[k].tool), t = b.leaf(j);
                    if ((X * Vec3(s.x, s.y, s.z) - Vec3(t.x, t.y, t.z)).norm() <= double(s.r) + double(t.r) + margin)
                        found.emplace_back(buckets[k].tool, j);
                }
        });
        std::sort(found.begin(), found.end());
        INFO("round " << round);
        CHECK(found == all);
        pairs += static_cast<int>(all.size());
    }
    CHECK(pairs > 1000);
}

}  // namespace
}  // namespace touchstone::tree_check_tests
