#include "haptics/surface/surface_distance.hpp"

#include <catch2/catch.hpp>
#include <random>

#include "haptics/reference/mesh_reference.hpp"
#include "haptics/surface/surface_overlap.hpp"
#include "tests/support/mesh_world.hpp"

namespace touchstone::surface_distance_tests {

using test::surfaceOf;

namespace {

TriangleMesh star(unsigned seed) {
    TriangleMesh mesh = test::blobMesh(10, 18, 9);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> factor(0.8, 1.2);
    for (Vec3& p : mesh.vertices) p *= factor(random);
    return mesh;
}

struct Random {
    explicit Random(unsigned seed) : engine(seed) {}
    std::mt19937 engine;
    std::normal_distribution<double> normal;
    Vec3 vector() { return {normal(engine), normal(engine), normal(engine)}; }
};

}  // namespace

TEST_CASE("surface distance: the nearest points of two parts are as far apart as the reference says") {
    const TriangleMesh mesh = star(1), other = star(2);
    const Surface tool = surfaceOf(mesh), obstacle = surfaceOf(other);
    const MeshReference reference(mesh, Vec3::Zero(), {{other, Pose{}}});
    Random random(3);
    FacePair near;
    int apart = 0;
    for (int i = 0; i < 60; ++i) {
        const Pose X_OT{(17 + 8 * std::abs(random.normal(random.engine))) * random.vector().normalized(),
                        expRotation(random.vector())};
        constexpr double kMost = 6;
        const double expected = reference.clearance(X_OT, kMost);
        const auto found = nearestPoints(tool, obstacle, X_OT, kMost);
        CAPTURE(i, expected);
        REQUIRE(found.has_value() == (expected < kMost));
        // From the pair of the last pose, and without a limit, the distance is the same.
        const auto again = nearestPoints(tool, obstacle, X_OT, 1e30, &near);
        REQUIRE(again);
        CHECK(again->distance() >= expected - 1e-9);
        if (!found) continue;
        CHECK(found->distance() == Approx(expected).margin(1e-9));
        CHECK(again->distance() == found->distance());
        CHECK(distanceTo(obstacle, found->onObstacle) < 1e-9);
        CHECK(distanceTo(tool, X_OT.inverse() * found->onTool) < 1e-9);
        apart += expected > 0;
    }
    CHECK(apart > 20);
}

TEST_CASE("surface distance: that of a point is the smallest over all faces") {
    const Surface part = surfaceOf(star(4));
    Random random(5);
    for (int i = 0; i < 200; ++i) {
        const Vec3 p = 8 * random.vector();
        double least = HUGE_VAL;
        for (int f = 0; f < int(part.features.faces.size()); ++f)
            least = std::min(least, (closestPoint(p, part.features.triangle(f), false) - p).norm());
        CHECK(distanceTo(part, p) == least);
        CHECK(distanceTo(part, p, 1) == std::min(1.0, least));
    }
}

TEST_CASE("surface distance: the clearance of a cube is its distance, and its depth once it overlaps") {
    const TriangleMesh cube = test::boxMesh({2, 2, 2}, {-1, -1, -1});
    const Surface tool = surfaceOf(cube), obstacle = surfaceOf(test::boxMesh({20, 20, 20}, {-10, -10, -10}));
    const auto at = [&](double x, double most) {
        return clearance(tool, obstacle, {{x, 0.3, 0.1}, Quat::Identity()}, most);
    };
    CHECK(at(11.5, 1e30) == Approx(0.5));
    CHECK(at(11.5, 0.2) == 0.2);
    CHECK(at(10.8, 1e30) == Approx(-0.2));
    CHECK(at(3, 1e30) == Approx(-8));  // wholly inside: the deepest corner is 8 mm below the nearest face
}

}  // namespace touchstone::surface_distance_tests
