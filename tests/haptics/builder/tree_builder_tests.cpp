#include "haptics/builder/tree_builder.hpp"

#include <catch2/catch.hpp>
#include <cstring>
#include <random>
#include <stdexcept>

#include "tests/support/test_meshes.hpp"

namespace touchstone::tree_builder_tests {
namespace {

using test::leavesOf;

bool sameBits(const SphereTree& a, const SphereTree& b) {
    const auto x = leavesOf(a), y = leavesOf(b);
    return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof(Sphere)) == 0 &&
           a.certificate.protrusion == b.certificate.protrusion;
}

/// Checks that random points of the surface and all corners lie in a leaf.
void checkCovered(const TriangleMesh& mesh, const SphereTree& tree, int samples, unsigned seed) {
    INFO("seed " << seed);
    std::mt19937 random(seed);
    CHECK(test::barePoints(mesh, tree, samples, random) == 0);
    const auto leaves = leavesOf(tree);
    for (const Triangle& t : test::trianglesOf(mesh))
        for (const Vec3& p : t)
            CHECK(std::any_of(leaves.begin(), leaves.end(),
                              [&](const Sphere& s) { return (p - s.center()).norm() <= s.r; }));
}

/// Checks that random points of leaf spheres are inside the mesh or no further outside than the certificate says.
void checkProtrusion(const TriangleMesh& mesh, const SphereTree& tree, int samples, unsigned seed) {
    INFO("seed " << seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    const auto triangles = test::trianglesOf(mesh);
    std::uniform_int_distribution<int> pick(0, tree.leafCount() - 1);
    double worst = 0;
    for (int i = 0; i < samples; ++i) {
        const Sphere s = tree.leaf(pick(random));
        const Vec3 p = s.center() + double(s.r) * Vec3(normal(random), normal(random), normal(random)).normalized();
        if (std::abs(test::bruteWinding(p, triangles)) < 0.5)
            worst = std::max(worst, test::bruteDistance(p, triangles));
    }
    CHECK(worst <= tree.certificate.protrusion);
    CHECK(worst > 0.3 * tree.certificate.protrusion);  // the bound is tight, not just large
}

TEST_CASE("tree builder: the leaves cover the surface and stay near the body", "[tree]") {
    struct Case {
        const char* name;
        TriangleMesh mesh;
        int leaves;
        double percent;  // of the diagonal: 1.5 times the measured value
    };
    const std::vector<Case> cases{{"cube", test::boxMesh(Vec3(10, 10, 10)), 64, 7.5},
                                  {"box", test::boxMesh(Vec3(60, 60, 20)), 512, 1.7},
                                  {"torus", test::torusMesh(10, 3), 256, 0.5},
                                  {"blob", test::blobMesh(20), 256, 0.5},
                                  {"cylinder", test::cylinderMesh(10, 30), 256, 1.8},
                                  {"plate 1 mm", test::boxMesh(Vec3(60, 60, 1)), 600, 2.7},
                                  {"plate 0.4 mm", test::boxMesh(Vec3(60, 60, 0.4)), 600, 2.9}};
    for (const Case& c : cases) {
        INFO(c.name);
        const SphereTree tree = buildSphereTree(c.mesh, {.leaves = c.leaves});
        const TreeCertificate& certificate = tree.certificate;
        CHECK(tree.leafCount() <= c.leaves);
        CHECK(tree.leafCount() > 0.8 * c.leaves);
        CHECK(certificate.covered);
        CHECK(certificate.closed);
        INFO("protrusion " << 100 * certificate.protrusion / certificate.diagonal << " % of the diagonal");
        CHECK(certificate.protrusion < 0.01 * c.percent * certificate.diagonal);
        checkCovered(c.mesh, tree, 1500, 3);
        checkProtrusion(c.mesh, tree, 800, 4);
    }
}

TEST_CASE("tree builder: more leaves protrude less", "[tree]") {
    const TriangleMesh mesh = test::cylinderMesh(10, 30);
    double before = HUGE_VAL;
    for (int leaves : {4, 32, 256}) {
        const double protrusion = buildSphereTree(mesh, {.leaves = leaves}).certificate.protrusion;
        CHECK(protrusion < 0.6 * before);
        before = protrusion;
    }
}

TEST_CASE("tree builder: the note for thin parts recommends more leaves", "[tree]") {
    CHECK(buildSphereTree(test::boxMesh(Vec3(10, 10, 10)), {.leaves = 64}).certificate.note.empty());
    CHECK_FALSE(buildSphereTree(test::boxMesh(Vec3(60, 60, 0.4)), {.leaves = 300}).certificate.note.empty());
}

TEST_CASE("tree builder: any number of leaves works", "[tree]") {
    const TriangleMesh mesh = test::boxMesh(Vec3(10, 10, 10));
    for (int leaves : {-1, 0, 1, 2, 3, 7, 8, 9, 33}) {
        const SphereTree tree = buildSphereTree(mesh, {.leaves = leaves});
        CHECK(tree.leafCount() >= 1);
        CHECK(tree.leafCount() <= std::max(1, leaves));
        CHECK(tree.certificate.covered);
        checkCovered(mesh, tree, 500, 5);
    }
}

TEST_CASE("tree builder: hard meshes are covered, and open ones say so", "[tree]") {
    const TriangleMesh box = test::boxMesh(Vec3(10, 10, 10));
    TriangleMesh single;
    single.vertices = {Vec3(0, 0, 0), Vec3(10, 0, 0), Vec3(0, 10, 0)};
    single.triangles = {{0, 1, 2}};
    TriangleMesh both = single;
    both.triangles.push_back({0, 2, 1});
    TriangleMesh open = box;
    open.triangles.resize(10);
    TriangleMesh holed = test::blobMesh(10, 20, 11);
    holed.triangles.erase(holed.triangles.begin() + 150);
    TriangleMesh mixed = test::blobMesh(10, 20, 11);
    for (std::size_t i = 0; i < mixed.triangles.size(); i += 2) std::swap(mixed.triangles[i][0], mixed.triangles[i][1]);
    TriangleMesh withLine = box;
    withLine.triangles.push_back({0, 0, 7});
    const TriangleMesh inner = test::boxMesh(Vec3(6, 6, 6), Vec3(2, 2, 2));
    struct Case {
        const char* name;
        TriangleMesh mesh;
        bool closed;
    };
    const std::vector<Case> cases{
        {"inverted", test::flipped(box), true},
        {"mixed", mixed, true},
        {"unwelded", test::unwelded(box), true},
        {"duplicates", test::joined(box, box), true},
        {"degenerate face", withLine, true},
        {"inner shell", test::joined(box, inner), true},
        {"cavity", test::joined(box, test::flipped(inner)), true},
        {"overlap", test::joined(box, test::boxMesh(Vec3(10, 10, 10), Vec3(5, 5, 5))), true},
        {"touching", test::joined(box, test::boxMesh(Vec3(10, 10, 10), Vec3(10, 0, 0))), true},
        {"apart", test::joined(box, test::boxMesh(Vec3(1, 1, 1), Vec3(300, 0, 0))), true},
        {"single triangle", single, false},
        {"double sided", both, false},
        {"open box", open, false},
        {"small hole", holed, true},
        {"soup", test::soupMesh(200, 2, 9), false},
        {"dense soup", test::soupMesh(100, 15, 9), false},
        {"large", test::moved(box, 1e30, Vec3::Zero()), true},
        {"small", test::moved(box, 1e-20, Vec3::Zero()), true},
        {"far", test::moved(box, 1, Vec3(1e6 + 0.3, -2e6 + 0.1, 7)), true},
    };
    for (const Case& c : cases) {
        INFO(c.name);
        const SphereTree tree = buildSphereTree(c.mesh, {.leaves = 100});
        CHECK(tree.leafCount() <= 100);
        CHECK(tree.certificate.covered);
        CHECK(tree.certificate.closed == c.closed);
        CHECK(tree.certificate.note.empty() == c.closed);
        checkCovered(c.mesh, tree, 1000, 6);
    }
}

TEST_CASE("tree builder: a shell inside a solid uses no leaves", "[tree]") {
    const TriangleMesh box = test::boxMesh(Vec3(10, 10, 10));
    const TriangleMesh nested = test::joined(box, test::boxMesh(Vec3(6, 6, 6), Vec3(2, 2, 2)));
    const double plain = buildSphereTree(box, {.leaves = 256}).certificate.protrusion;
    CHECK(buildSphereTree(nested, {.leaves = 256}).certificate.protrusion < 1.3 * plain);
}

TEST_CASE("tree builder: large balls carry the flats", "[tree]") {
    const SphereTree tree = buildSphereTree(test::boxMesh(Vec3(60, 60, 20)), {.leaves = 512});
    int large = 0;
    for (const Sphere& s : leavesOf(tree)) large += s.r > 9;
    CHECK(large > 30);
}

TEST_CASE("tree builder: the same mesh gives the same bits", "[tree]") {
    const TriangleMesh mesh = test::cylinderMesh(10, 30);
    CHECK(sameBits(buildSphereTree(mesh, {.leaves = 100}), buildSphereTree(mesh, {.leaves = 100})));
}

TEST_CASE("tree builder: progress rises to one", "[tree]") {
    double before = 0;
    int calls = 0;
    bool rising = true;
    buildSphereTree(test::cylinderMesh(10, 30), {.leaves = 64}, [&](const BuildStatus& status) {
        rising = rising && status.fraction >= before && status.fraction <= 1;
        before = status.fraction;
        ++calls;
        return true;
    });
    CHECK(rising);
    CHECK(calls >= 5);
    CHECK(before == 1);
}

TEST_CASE("tree builder: cancelling ends the build at any call", "[tree]") {
    const TriangleMesh mesh = test::cylinderMesh(10, 30);
    for (int allowed = 0; allowed < 5; ++allowed) {
        int calls = 0;
        CHECK_THROWS_AS(buildSphereTree(mesh, {.leaves = 64}, [&](const BuildStatus&) { return calls++ < allowed; }),
                        BuildCancelled);
        CHECK(calls == allowed + 1);
    }
}

TEST_CASE("tree builder: a face that is folded over does not make balls outside", "[tree]") {
    // A vertex on the diagonal of the top, which lies beyond it: the strip between faces down.
    TriangleMesh folded = test::boxMesh(Vec3(10, 10, 10));
    const double top = folded.vertices[folded.triangles[0][0]].z();
    std::vector<std::array<std::uint32_t, 3>> faces;
    std::vector<std::array<std::uint32_t, 3>> tops;
    for (const auto& t : folded.triangles) {
        const bool flat = std::all_of(t.begin(), t.end(), [&](auto v) { return folded.vertices[v].z() == top; });
        (flat ? tops : faces).push_back(t);
    }
    REQUIRE(tops.size() == 2);
    // tops[0] is a, b, c with the diagonal from a to c or another order: find the two vertices that both have.
    const auto has = [](const auto& t, std::uint32_t v) { return std::find(t.begin(), t.end(), v) != t.end(); };
    int k = 0;
    while (has(tops[1], tops[0][k])) ++k;
    const std::uint32_t b = tops[0][k], c = tops[0][(k + 1) % 3], a = tops[0][(k + 2) % 3];
    const auto m = static_cast<std::uint32_t>(folded.vertices.size());
    const Vec3 middle = (folded.vertices[a] + folded.vertices[c]) / 2;
    folded.vertices.push_back(middle + 0.5 * (middle - folded.vertices[b]));
    faces.insert(faces.end(), {{a, b, m}, {b, c, m}, {a, m, c}, tops[1]});
    folded.triangles.assign(faces.begin(), faces.end());
    const double plain = buildSphereTree(test::boxMesh(Vec3(10, 10, 10)), {.leaves = 2000}).certificate.protrusion;
    const SphereTree tree = buildSphereTree(folded, {.leaves = 2000});
    CHECK(tree.certificate.closed);
    CHECK(tree.certificate.covered);
    CHECK(tree.certificate.protrusion < 1.5 * plain);
}

TEST_CASE("tree builder: an error out of reach is refused, and open meshes are told to be the cause", "[tree]") {
    TriangleMesh open = test::boxMesh(Vec3(10, 10, 10));
    open.triangles.resize(10);
    CHECK_THROWS_WITH(buildSphereTree(open, {.maxError = 1e-9}), Catch::Contains("or close the mesh"));
}

TEST_CASE("tree builder: a mesh without area is refused", "[tree]") {
    TriangleMesh line;
    line.vertices = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(2, 0, 0)};
    line.triangles = {{0, 1, 2}};
    CHECK_THROWS_AS(buildSphereTree(line, {.leaves = 8}), std::invalid_argument);
    CHECK_THROWS_AS(buildSphereTree(TriangleMesh{}, {.leaves = 8}), std::invalid_argument);
}

}  // namespace
}  // namespace touchstone::tree_builder_tests
