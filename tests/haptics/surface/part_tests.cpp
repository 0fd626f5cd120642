// Parts as another program makes them: from triangles, through the library's one header.
#include <catch2/catch.hpp>
#include <cmath>

#include "haptics/touchstone.hpp"
#include "tests/support/test_meshes.hpp"

namespace touchstone::part_tests {

using Catch::Contains;

namespace {

TriangleMesh box() { return test::boxMesh({10, 12, 14}, {-5, -6, -7}); }

TriangleMesh withoutLid() {
    TriangleMesh mesh = box();
    mesh.triangles.resize(mesh.triangles.size() - 2);
    return mesh;
}

}  // namespace

TEST_CASE("part: a closed mesh is touched by its surface, with spheres only if asked", "[part]") {
    for (const int spheres : {0, 64}) {
        const Part part = Part::fromTriangles(box(), {.spheres = spheres});
        CAPTURE(spheres);
        REQUIRE(part.surface);
        CHECK((part.spheres != nullptr) == (spheres > 0));
        CHECK(part.center().norm() < 1e-6);
        CHECK(part.reach() == Approx(Vec3(5, 6, 7).norm()));
    }
}

TEST_CASE("part: a mesh that cannot be touched by its surface gets one sentence, or spheres", "[part]") {
    CHECK_THROWS_WITH(Part::fromTriangles(withoutLid()),
                      Contains("not closed") && Contains("1 hole") && Contains("ask for spheres"));
    const Part part = Part::fromTriangles(withoutLid(), {.spheres = 64});
    CHECK_FALSE(part.surface);
    CHECK(part.spheres);

    TriangleMesh outOfRange = box();
    outOfRange.triangles[3][1] = 99;
    CHECK_THROWS_WITH(Part::fromTriangles(outOfRange), Contains("triangle 3 has corner 99"));
    TriangleMesh notFinite = box();
    notFinite.vertices[2].y() = NAN;
    CHECK_THROWS_AS(Part::fromTriangles(notFinite), std::invalid_argument);
    CHECK_THROWS_AS(Part::fromTriangles({}), std::invalid_argument);
    CHECK_THROWS_AS(Part::fromTriangles(box(), {.spheres = -1}), std::invalid_argument);
}

TEST_CASE("part: friction of a pair needs two materials and follows the earlier of their rules", "[part]") {
    using enum FrictionRule;
    constexpr FrictionRule kRules[] = {Average, Minimum, Maximum, Multiply};
    const double expected[] = {0.5, 0.2, 0.8, 0.16};  // of 0.2 and 0.8
    for (const FrictionRule a : kRules)
        for (const FrictionRule b : kRules) {
            World world{.tool = {.material = Material{{0.2, 0.2}, a}},
                        .obstacles = {{"rough", {.material = Material{{0.8, 0.8}, b}}}, {"smooth", {}}}};
            const double mu = expected[std::size_t(std::min(a, b))];
            CAPTURE(int(a), int(b));
            CHECK(world.friction(0).atRest == Approx(mu));
            CHECK(world.friction(0).sliding == Approx(mu));
            CHECK_FALSE(world.friction(1).any());
            CHECK(world.friction(0, {.frictionScale = 2}).sliding == Approx(2 * mu));
            CHECK_FALSE(world.friction(0, {.friction = false}).any());
            CHECK(world.friction(1, {.frictionCoefficient = 0.3}) == Friction{0.3, 0.3});
        }
}

TEST_CASE("part: layouts that a program shares with the library do not depend on the processor", "[part]") {
    // Eigen aligns what fits a vector register, which is wider on some processors; none of these may be.
    CHECK(alignof(Pose) == alignof(double));
    CHECK(sizeof(Pose) == 7 * sizeof(double));
    CHECK(alignof(Wrench) == alignof(double));
    CHECK(alignof(TickInput) == alignof(double));
    CHECK(alignof(TickRecord) == alignof(double));
    CHECK(alignof(World) == alignof(double));
}

}  // namespace touchstone::part_tests
