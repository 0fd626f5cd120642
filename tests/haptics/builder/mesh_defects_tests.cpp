// What scanners and modeling programs leave behind, on parts of each kind, judged by volume and by where the surface
// is.
#include <catch2/catch.hpp>

#include "haptics/builder/tree_builder.hpp"
#include "haptics/surface/surface_distance.hpp"
#include "haptics/surface/surface_overlap.hpp"
#include "tests/support/test_meshes.hpp"

namespace touchstone::mesh_defects_tests {
namespace {

/// A square block, 30 x 30 x 30 mm, with a blind hole of radius 5.2 mm and 20 mm from the top. Its top comes last.
TriangleMesh blockWithHole() {
    constexpr std::uint32_t n = 48;
    TriangleMesh m;
    const auto ring = [&](double z, auto&& radiusAt) {
        for (std::uint32_t i = 0; i < n; ++i) {
            const double a = 2 * std::numbers::pi * (i + 6) / n;
            m.vertices.push_back(Vec3(0, 0, z) + radiusAt(a) * Vec3(std::cos(a), std::sin(a), 0));
        }
    };
    const auto square = [](double a) { return 15 / std::max(std::abs(std::cos(a)), std::abs(std::sin(a))); };
    ring(-20, square);
    ring(10, square);
    ring(10, [](double) { return 5.2; });
    ring(-10, [](double) { return 5.2; });
    m.vertices.insert(m.vertices.end(), {Vec3(0, 0, -20), Vec3(0, 0, -10)});
    const auto wall = [&](std::uint32_t k) {
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = k * n + i, b = k * n + (i + 1) % n, c = a + n, d = b + n;
            m.triangles.push_back({a, b, d});
            m.triangles.push_back({a, d, c});
        }
    };
    wall(0);
    wall(2);
    for (std::uint32_t i = 0; i < n; ++i) {
        m.triangles.push_back({4 * n, (i + 1) % n, i});
        m.triangles.push_back({4 * n + 1, 3 * n + i, 3 * n + (i + 1) % n});
    }
    wall(1);
    return m;
}

/// A tube of length 100 mm between the radii 5 and 6 mm. The ring at its top comes last.
TriangleMesh thickTube() {
    constexpr std::uint32_t n = 24;
    TriangleMesh m;
    for (const auto& [r, z] : {std::pair(6.0, 0.0), {6.0, 100.0}, {5.0, 100.0}, {5.0, 0.0}})
        for (std::uint32_t i = 0; i < n; ++i) {
            const double a = 2 * std::numbers::pi * i / n;
            m.vertices.push_back({r * std::cos(a), r * std::sin(a), z});
        }
    for (const std::uint32_t k : {0u, 2u, 3u, 1u})
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = k * n + i, b = k * n + (i + 1) % n, c = (a + n) % (4 * n), d = (b + n) % (4 * n);
            m.triangles.push_back({a, b, d});
            m.triangles.push_back({a, d, c});
        }
    return m;
}

struct Part {
    const char* name;
    TriangleMesh mesh;
    double bend;  ///< mm: how far a cap may lie from the surface of two curved triangles
};
std::vector<Part> parts() {
    return {{"box", test::boxMesh(Vec3(10, 10, 10)), 0},
            {"plate", test::boxMesh(Vec3(100, 60, 1)), 0},
            {"peg", test::cylinderMesh(5, 29), 0},
            {"block with a hole", blockWithHole(), 0},
            {"thick tube", thickTube(), 0},
            {"blob", test::blobMesh(10), 0.1},
            {"torus", test::torusMesh(20, 5, 24, 12), 0.5}};
}

double volumeOf(const RepairedMesh& body) {
    double volume = 0;
    for (const auto& w : body.walls)
        volume += body.vertices[w[0]].dot(body.vertices[w[1]].cross(body.vertices[w[2]])) / 6;
    return volume / std::pow(body.scale, 3);
}

TriangleMesh without(TriangleMesh mesh, std::vector<std::size_t> triangles) {
    std::sort(triangles.rbegin(), triangles.rend());
    for (const std::size_t t : triangles) mesh.triangles.erase(mesh.triangles.begin() + std::ptrdiff_t(t));
    return mesh;
}

Triangle at(const TriangleMesh& mesh, std::size_t t) {
    const auto& c = mesh.triangles[t];
    return {mesh.vertices[c[0]], mesh.vertices[c[1]], mesh.vertices[c[2]]};
}

/// Whether the triangles have an edge in common.
bool adjoin(const TriangleMesh& mesh, std::size_t a, std::size_t b) {
    int common = 0;
    for (const auto i : mesh.triangles[a])
        for (const auto j : mesh.triangles[b]) common += i == j;
    return common == 2;
}

TriangleMesh strayAt(const Vec3& p, double size = 0.4) {
    return {{p, p + Vec3(size, 0, 0), p + Vec3(0, size, 0)}, {{0, 1, 2}}};
}

/// Checks that the repaired part is the intact one: closed, of its volume, and with its surface at these triangles.
void checkSame(const TriangleMesh& damaged, const TriangleMesh& intact, const std::vector<std::size_t>& places,
               double bend) {
    const RepairedMesh body = repairMesh(damaged);
    REQUIRE(body.closed());
    double area = 0;
    for (const std::size_t t : places) area += areaOf(at(intact, t));
    const RepairedMesh whole = repairMesh(intact);
    CHECK(volumeOf(body) == Approx(volumeOf(whole)).epsilon(1e-9).margin(bend * area));
    const Surface surface(surfaceFeatures(body));
    for (const std::size_t t : places) {
        const Triangle face = at(intact, t);
        const Vec3 middle = (face[0] + face[1] + face[2]) / 3,
                   normal = (face[1] - face[0]).cross(face[2] - face[0]).normalized();
        CHECK(distanceTo(surface, middle) <= bend + 1e-9);  // rounding of the weld
        CHECK(isInside(surface, middle - (bend + 0.01) * normal));
        CHECK_FALSE(isInside(surface, middle + (bend + 0.01) * normal));
    }
}

TEST_CASE("mesh defects: a missing triangle is found again, whichever it is", "[tree]") {
    for (const Part& part : parts()) {
        const std::size_t count = part.mesh.triangles.size(), step = 1 + count / 12;
        for (std::size_t t = 0; t < count; t += step) {
            INFO(part.name << ", triangle " << t);
            checkSame(without(part.mesh, {t}), part.mesh, {t}, 0);
            const RepairedMesh body = repairMesh(without(part.mesh, {t}));
            REQUIRE(body.closedHoles.size() == 1);
            const Triangle face = at(part.mesh, t);
            CHECK((body.closedHoles[0].place - (face[0] + face[1] + face[2]) / 3).norm() <= body.closedHoles[0].across);
            CHECK(body.closedHoles[0].triangles == 1);
        }
    }
}

TEST_CASE("mesh defects: two adjacent triangles that are missing are closed as they were, or named", "[tree]") {
    for (const Part& part : parts()) {
        const std::size_t count = part.mesh.triangles.size();
        int closed = 0, tried = 0;
        for (std::size_t a = 0; a < count; a += 1 + count / 8)
            for (std::size_t b = 0; b < count; ++b) {
                if (a == b || !adjoin(part.mesh, a, b)) continue;
                INFO(part.name << ", triangles " << a << ", " << b);
                const TriangleMesh damaged = without(part.mesh, {a, b});
                ++tried;
                if (!repairMesh(damaged).closed()) {
                    const MeshDefects defects = defectsOf(repairMesh(damaged));
                    CHECK(defects.holes == 1);
                    CHECK(defects.openEdges == 4);
                    CHECK(defects.largest.across > 0);
                    continue;
                }
                ++closed;
                checkSame(damaged, part.mesh, {a, b}, part.bend);
            }
        INFO(part.name << ": " << closed << " of " << tried);
        CHECK(2 * closed >= tried);
    }
}

TEST_CASE("mesh defects: an opening is closed if it is flat, one and small, and named if it may be meant", "[tree]") {
    const TriangleMesh peg = test::cylinderMesh(5, 29);
    std::vector<std::size_t> top, bottom;
    for (std::size_t t = 0; t < peg.triangles.size(); ++t) {
        const Triangle face = at(peg, t);
        const double sum = face[0].z() + face[1].z() + face[2].z();
        if (sum == 0) bottom.push_back(t);
        if (sum == 3 * 29) top.push_back(t);
    }
    REQUIRE(!top.empty());
    checkSame(without(peg, top), peg, top, 0);
    CHECK(repairMesh(without(peg, top)).closedHoles.size() == 1);
    std::vector<std::size_t> both = top;
    both.insert(both.end(), bottom.begin(), bottom.end());
    CHECK_FALSE(repairMesh(without(peg, both)).closed());  // a pipe
    // The same surface with its front inside is that of a blind hole.
    CHECK_FALSE(repairMesh(test::flipped(without(peg, top))).closed());
    // A box without a lid.
    const TriangleMesh box = test::boxMesh(Vec3(10, 10, 10));
    CHECK_FALSE(repairMesh(without(box, {10, 11})).closed());
    CHECK(defectsOf(repairMesh(without(box, {10, 11}))).largest.across == Approx(std::sqrt(200)));
    // A ring is closed as a ring: the bore stays open.
    const TriangleMesh tube = thickTube();
    std::vector<std::size_t> ring;
    for (std::size_t t = tube.triangles.size() - 48; t < tube.triangles.size(); ++t) ring.push_back(t);
    checkSame(without(tube, ring), tube, ring, 0);
    CHECK_FALSE(isInside(Surface(surfaceFeatures(repairMesh(without(tube, ring)))), Vec3(0, 0, 99)));
    // Something stands in the opening.
    const TriangleMesh pin = test::moved(test::boxMesh(Vec3(1, 1, 40)), 1, Vec3(-0.5, -0.5, 1));
    CHECK_FALSE(repairMesh(test::joined(without(peg, top), pin)).closed());
}

TEST_CASE("mesh defects: stray triangles are left out, wherever they are, and the part is as without them", "[tree]") {
    for (const Part& part : parts()) {
        Vec3 high = Vec3::Constant(-1e9);
        for (const Vec3& v : part.mesh.vertices) high = high.cwiseMax(v);
        const Triangle face = at(part.mesh, 1);
        TriangleMesh hanging = part.mesh;  // on an edge, and on a corner
        const Vec3 normal = (face[1] - face[0]).cross(face[2] - face[0]).normalized();
        const auto& c = part.mesh.triangles[1];
        const auto next = std::uint32_t(hanging.vertices.size());
        const Vec3 aside = (face[1] - face[0]).normalized().cross(normal);
        hanging.vertices.insert(hanging.vertices.end(), {face[2] + 0.2 * normal, face[2] + 0.2 * normal + 0.2 * aside,
                                                         (face[0] + face[1]) / 2 + 0.02 * normal + 0.01 * aside});
        TriangleMesh onCorner = hanging, onEdge = hanging;
        onCorner.triangles.push_back({c[2], next, next + 1});
        onEdge.triangles.push_back({c[0], c[1], next + 2});
        TriangleMesh twoSided = test::joined(part.mesh, strayAt(high + Vec3(1, 1, 1)));
        twoSided = test::joined(twoSided, test::flipped(strayAt(high + Vec3(1, 1, 1))));
        const RepairedMesh whole = repairMesh(part.mesh);
        const auto check = [&](const char* where, const TriangleMesh& mesh, int loose) {
            INFO(part.name << ", " << where);
            const RepairedMesh body = repairMesh(mesh);
            CHECK(body.closed());
            CHECK(body.vertices == whole.vertices);
            CHECK(body.walls == whole.walls);
            CHECK(body.scale == whole.scale);
            CHECK(body.cover == whole.cover);
            int counted = 0;
            for (const MeshPatch& patch : body.loose) counted += patch.triangles;
            CHECK(counted == loose);
        };
        check("near", test::joined(part.mesh, strayAt(high + Vec3(0.8, 0.1, 0.1))), 1);
        for (const double far : {400.0, 4e3, 4e4, 9e5})
            check("far", test::joined(part.mesh, strayAt(high + Vec3(far, 0, 0))), 1);
        check("on a corner", onCorner, 1);
        check("on an edge", onEdge, 1);
        check("several", test::joined(onCorner, test::joined(strayAt(Vec3(0, 500, 0)), strayAt(Vec3(-90, 0, 9)))), 3);
        check("two-sided", twoSided, 2);
    }
}

TEST_CASE("mesh defects: several at once are repaired together", "[tree]") {
    for (const Part& part : parts()) {
        INFO(part.name);
        const std::size_t count = part.mesh.triangles.size();
        const std::size_t first = 1, second = count / 2 + 2;
        TriangleMesh mesh = part.mesh;
        mesh.triangles.push_back(mesh.triangles[4]);                                                   // a copy
        mesh.triangles.push_back({mesh.triangles[6][1], mesh.triangles[6][0], mesh.triangles[6][2]});  // turned over
        mesh.triangles.push_back({mesh.triangles[8][1], mesh.triangles[8][1], mesh.triangles[8][2]});  // no area
        mesh = without(mesh, {first, second});
        mesh = test::joined(test::joined(mesh, strayAt(Vec3(0, 0, 400))), strayAt(Vec3(0, 120, 0)));
        checkSame(mesh, part.mesh, {first, second}, 0);
        checkSame(test::unwelded(mesh), part.mesh, {first, second}, 0);
    }
}

TEST_CASE("mesh defects: what may be meant is kept: a fin, a foil beside a body, an open part", "[tree]") {
    const TriangleMesh box = test::boxMesh(Vec3(10, 10, 10));
    CHECK_FALSE(repairMesh(test::joined(box, strayAt(Vec3(12, 0, 0), 9))).closed());
    // Half a ball encloses nearly something.
    TriangleMesh ball = test::moved(test::sphereMesh(1), 1, Vec3(15, 5, 5));
    std::erase_if(ball.triangles, [&](const auto& t) {
        return ball.vertices[t[0]].z() + ball.vertices[t[1]].z() + ball.vertices[t[2]].z() > 15 + 1e-9;
    });
    const RepairedMesh body = repairMesh(test::joined(box, ball));
    CHECK(body.loose.empty());
    // Two closed bodies far apart are both kept, however small one is.
    const RepairedMesh pair = repairMesh(test::joined(box, test::boxMesh(Vec3(0.1, 0.1, 0.1), Vec3(900, 0, 0))));
    CHECK(pair.closed());
    CHECK(pair.walls.size() == 24);
}

TEST_CASE("mesh defects: spheres cover what closes a hole, and not what was left out", "[tree]") {
    const TriangleMesh peg = test::cylinderMesh(5, 29);
    TreeOptions options;
    options.leaves = 128;
    const TriangleMesh damaged = test::joined(without(peg, {3}), strayAt(Vec3(40, 0, 0)));
    const SphereTree tree = buildSphereTree(damaged, options);
    CHECK(tree.certificate.covered);
    CHECK(tree.certificate.closed);
    CHECK(tree.certificate.note.empty());
    std::mt19937 random(7);
    CHECK(test::barePoints(peg, tree, 2000, random) == 0);
    for (const Sphere& leaf : test::leavesOf(tree)) CHECK(leaf.center().x() < 20);
}

}  // namespace
}  // namespace touchstone::mesh_defects_tests
