#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "tests/parts/mesh_checks.hpp"
#include "tools/parts/shapes.hpp"
#include "tools/parts/turned.hpp"

namespace touchstone::app::turned_tests {
namespace {

constexpr double kPi = std::numbers::pi;

/// Chords lose at most their sagitta along the outer circle.
double loss(double radius, double height) { return 2 * kPi * radius * kChordError * height; }

}  // namespace

TEST_CASE("turned: a ring is closed and has its volume", "[parts]") {
    TurnedSolid solid;
    solid.add({6, 10, -3, 5});
    const engine::MeshData mesh = solid.mesh(2);
    CHECK(isClosed(mesh));
    const double exact = kPi * (100 - 36) * 8;
    CHECK(volume(mesh) < exact);
    CHECK(volume(mesh) > exact - loss(10, 8));
}

TEST_CASE("turned: flanks of opposite offset are parallel in any sector", "[parts]") {
    const double angle = GENERATE(0.0, 1.3, -2.0, 6.2);
    TurnedSolid solid;
    solid.add({5, 12, 0, 4, {angle, -2}, {angle, 2}});
    const engine::MeshData mesh = solid.mesh(1);
    CHECK(isClosed(mesh));
    // In the sector's own frame the sides are at +-2 across, and nothing is further out.
    double across = 0, along = 1e300;
    for (const glm::vec3& p : mesh.positions) {
        const double x = 1000 * p.x, z = 1000 * p.z;
        across = std::max(across, std::abs(x * std::sin(angle) + z * std::cos(angle)));
        along = std::min(along, x * std::cos(angle) - z * std::sin(angle));
    }
    CHECK(across == Approx(2).epsilon(1e-6));
    CHECK(along == Approx(std::sqrt(25 - 4)).epsilon(1e-6));  // the corners on the inner circle
}

TEST_CASE("turned: cuts and additions apply in order", "[parts]") {
    TurnedSolid solid;
    solid.add({0, 10, 0, 10});
    solid.cut({4, 10, 2, 8, {-0.5}, {0.5}});  // a radian of the ring
    const double whole = kPi * 100 * 10, slot = 0.5 * (100 - 16) * 6, rib = 0.5 * (100 - 49) * 2;
    CHECK(volume(solid.mesh(1)) == Approx(whole - slot).margin(loss(10, 10)));
    solid.add({7, 10, 4, 6, {-0.5}, {0.5}});
    const engine::MeshData mesh = solid.mesh(1);
    CHECK(isClosed(mesh));
    CHECK(volume(mesh) == Approx(whole - slot + rib).margin(loss(10, 10)));
    CHECK(isInside(mesh, {8, 5, 0}));
    CHECK_FALSE(isInside(mesh, {8, 3, 0}));
    CHECK(isInside(mesh, {-8, 3, 0}));
}

TEST_CASE("turned: impossible flanks are refused in one sentence", "[parts]") {
    TurnedSolid crossing;
    crossing.add({5, 12, 0, 4, {0, -4}, {0, 4}});
    crossing.add({5, 12, 0, 4, {0.7, -4}, {0.7, 4}});  // separate at 12 mm, overlapping at 5
    CHECK_THROWS_WITH(crossing.mesh(1), Catch::Contains("flanks cross"));
    TurnedSolid wide;
    wide.add({3, 12, 0, 4, {0, -4}, {0, 4}});
    CHECK_THROWS_WITH(wide.mesh(1), Catch::Contains("off the axis"));
}

}  // namespace touchstone::app::turned_tests
