// Measures the force ripple of a flat surface that is made of spheres.
#include <catch2/catch.hpp>

#include "haptics/builder/tree_builder.hpp"
#include "haptics/loop/distances.hpp"
#include "haptics/loop/step.hpp"
#include "tests/support/sphere_models.hpp"
#include "tests/support/test_meshes.hpp"

namespace touchstone::ripple_tests {

using namespace touchstone::test;

namespace {

/// (max - min) / mean of the force on a ball of 5 mm. It is driven 5 mm below first contact and then slides 20 mm at
/// 20 mm/s, 17° off the edge, on the top of a box 60 x 60 x 20 mm, 15 mm from any edge.
double rippleOf(const TreeOptions& options) {
    const Vec3 size(60, 60, 20);
    World world =
        worldOf(ball(5), std::make_shared<const SphereTree>(buildSphereTree(boxMesh(size), options)), at(0, 0, 100));
    const double angle = 17 * M_PI / 180;
    const Vec3 along(std::cos(angle), std::sin(angle), 0), start(20, 25, size.z());
    const auto clearance = [&](double z) { return trueClearance(world, at(start.x(), start.y(), z)); };
    const double contact = size.z() + 10 - clearance(size.z() + 10);

    Settings settings;
    settings.shadow = kNoSolver;
    TickState state(world);
    state.reset(at(start.x(), start.y(), contact + 1));
    double least = HUGE_VAL, most = 0, sum = 0;
    constexpr int kPress = 600, kSettle = 200, kSlide = 1000;
    for (int tick = 0; tick < kPress + kSettle + kSlide; ++tick) {
        const double depth = std::min(5.0, -1 + 6.0 * tick / kPress);
        const Vec3 p = start + 0.02 * std::max(0, tick - kPress - kSettle) * along;
        const TickRecord record = step(world, settings, {at(p.x(), p.y(), contact - depth)}, state);
        if (tick < kPress + kSettle) continue;
        const double force = record.wrench_C.force.norm();
        least = std::min(least, force);
        most = std::max(most, force);
        sum += force;
    }
    CHECK(sum / kSlide == Approx(5).epsilon(0.05));  // 1 N/mm
    return (most - least) / (sum / kSlide);
}

}  // namespace

TEST_CASE("ripple: 4,096 leaves make a flat surface within 1 %", "[tree][step]") {
    const double ripple = rippleOf({.leaves = 4096});
    INFO(100 * ripple << " %");
    CHECK(ripple <= 0.01);
    CHECK(ripple > 0);  // spheres always leave some ripple
}

}  // namespace touchstone::ripple_tests
