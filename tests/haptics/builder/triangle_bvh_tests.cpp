#include "haptics/builder/triangle_bvh.hpp"

#include <catch2/catch.hpp>
#include <random>
#include <set>

#include "tests/support/test_meshes.hpp"

namespace touchstone::triangle_bvh_tests {
namespace {

Vec3 randomPoint(std::mt19937& random, double reach) {
    std::uniform_real_distribution<double> uniform(-reach, reach);
    return {uniform(random), uniform(random), uniform(random)};
}

// Rounding of a distance in a body of size 10; brute force has the same error.
constexpr double kRounding = 1e-11;

TEST_CASE("triangle tree: the closest point is that of brute force", "[tree]") {
    const unsigned seed = GENERATE(1u, 2u, 3u);
    INFO("seed " << seed);
    std::mt19937 random(seed);
    const TriangleMesh mesh = seed == 1 ? test::torusMesh(10, 3) : test::soupMesh(300, seed == 2 ? 1.0 : 20.0, seed);
    const std::vector<Triangle> triangles = test::trianglesOf(mesh);
    const TriangleBvh tree(triangles);
    for (int i = 0; i < 500; ++i) {
        const Vec3 p = randomPoint(random, 20);
        const double expected = test::bruteDistance(p, triangles);
        const auto hit = tree.closest(p);
        REQUIRE(hit.triangle >= 0);
        CHECK(hit.distance == Approx(expected).margin(kRounding));
        CHECK((hit.point - p).norm() == Approx(hit.distance).margin(kRounding));
        CHECK(test::bruteDistance(hit.point, triangles[hit.triangle]) < kRounding);
        // A bound just above keeps the answer, a bound just below excludes it.
        CHECK(tree.closest(p, 1.001 * expected).distance == hit.distance);
        CHECK(tree.closest(p, 0.999 * expected).triangle == -1);
    }
}

TEST_CASE("triangle tree: needles and points are measured to their sides", "[tree]") {
    const Vec3 a(0, 0, 0), b(10, 0, 0);
    const std::vector<Triangle> triangles{{a, b, Vec3(5, 0, 0)}, {a, b, Vec3(5, 1e-12, 0)}, {a, a, a}};
    for (const Triangle& t : triangles) {
        const TriangleBvh tree({t});
        CHECK(tree.closest(Vec3(-3, 4, 0)).distance == Approx(5));
    }
    CHECK(TriangleBvh({triangles[0]}).closest(Vec3(4, 0, 2)).distance == Approx(2));
    CHECK(TriangleBvh({triangles[1]}).closest(Vec3(4, 0, 2)).distance == Approx(2));
}

TEST_CASE("triangle tree: an empty tree has no closest point, and its winding number is zero", "[tree]") {
    const TriangleBvh tree(std::vector<Triangle>{});
    CHECK(tree.empty());
    CHECK(tree.closest(Vec3(1, 2, 3)).triangle == -1);
    CHECK(tree.windingNumber(Vec3(1, 2, 3)) == 0);
}

TEST_CASE("triangle tree: the front is the side with counter-clockwise vertices", "[tree]") {
    const TriangleBvh tree({{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}});
    CHECK(tree.closest(Vec3(0.2, 0.2, 1)).front);
    CHECK_FALSE(tree.closest(Vec3(0.2, 0.2, -1)).front);
}

TEST_CASE("triangle tree: the winding number is that of the sum of all solid angles", "[tree]") {
    const unsigned seed = 7;
    INFO("seed " << seed);
    std::mt19937 random(seed);
    const std::vector<Triangle> torus = test::trianglesOf(test::torusMesh(10, 3, 48, 24));
    const TriangleBvh tree(torus);
    for (int i = 0; i < 1000; ++i) {
        const Vec3 p = randomPoint(random, 14);
        const double exact = test::bruteWinding(p, torus);
        const double inside = std::hypot(std::hypot(p.x(), p.y()) - 10, p.z());
        // The facets are up to 0.07 inside the torus.
        if (inside < 2.9) CHECK(exact == Approx(1).margin(1e-9));
        if (inside > 3.0) CHECK(exact == Approx(0).margin(1e-9));
        CHECK(std::abs(tree.windingNumber(p) - exact) <
              0.05);  // error of the dipoles: a tenth of the deciding threshold
    }
}

TEST_CASE("triangle tree: a box query returns every triangle whose box overlaps it", "[tree]") {
    const std::vector<Triangle> soup = test::trianglesOf(test::soupMesh(200, 2, 11));
    const TriangleBvh tree(soup);
    std::mt19937 random(5);
    for (int i = 0; i < 50; ++i) {
        Box box;
        box.add(randomPoint(random, 10));
        box.add(randomPoint(random, 10));
        std::set<int> found, expected;
        tree.overlapping(box, [&](int t) { found.insert(t); });
        for (int t = 0; t < static_cast<int>(soup.size()); ++t) {
            Box own;
            for (const Vec3& v : soup[t]) own.add(v);
            if ((own.lo.array() <= box.hi.array()).all() && (own.hi.array() >= box.lo.array()).all())
                expected.insert(t);
        }
        // The query returns whole buckets, so there may be more.
        CHECK(std::includes(found.begin(), found.end(), expected.begin(), expected.end()));
    }
}

}  // namespace
}  // namespace touchstone::triangle_bvh_tests
