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

TEST_CASE("surface distance: the first point on a ray is the nearest of all that it pierces") {
    const Surface part = surfaceOf(star(6));
    Random random(7);
    int hits = 0;
    for (int i = 0; i < 300; ++i) {
        const Vec3 from = i % 3 ? Vec3(40 * random.vector().normalized()) : Vec3(3 * random.vector());
        const Vec3 direction = i % 5 ? Vec3(6 * random.vector() - from) : Vec3(-from.x(), 0, 0);
        double least = HUGE_VAL;
        for (int f = 0; f < int(part.features.faces.size()); ++f)
            if (const auto at = piercing(from, from + 200 * direction.normalized(), part.features.triangle(f)))
                least = std::min(least, (*at - from).norm());
        const auto hit = firstHit(part, from, direction);
        CAPTURE(i, from.transpose(), direction.transpose(), least);
        REQUIRE(hit.has_value() == std::isfinite(least));
        if (hit) CHECK((*hit - from).norm() == Approx(least));
        hits += hit.has_value();
    }
    CHECK(hits > 100);
}

}  // namespace touchstone::surface_distance_tests
