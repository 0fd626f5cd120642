// Compares penalty mode with answers that follow from springs in series.
#include <catch2/catch.hpp>
#include <vector>

#include "haptics/loop/step.hpp"
#include "tests/support/sphere_models.hpp"

namespace touchstone::penalty_mode_tests {

using namespace touchstone::test;

namespace {

Settings penalty(double stiffness = 10) {
    Settings settings;
    settings.mode = Mode::Penalty;
    settings.shadow = kNoSolver;
    settings.penaltyStiffness = stiffness;
    return settings;
}

/// The tick at rest with the device at `end`, after a motion of `ticks`.
TickRecord pressed(const World& world, const Settings& settings, const Pose& end, int ticks = 400) {
    TickState state(world);
    TickRecord record;
    for (int tick = 1; tick <= 2 * ticks; ++tick) {
        const double share = std::min(1.0, double(tick) / ticks);
        const Vec3 p = world.X_WT_start.p + share * (end.p - world.X_WT_start.p);
        record = step(world, settings, {{p, end.q}}, state, {.audit = true});
    }
    return record;
}

}  // namespace

TEST_CASE("penalty: a pressed ball penetrates by the force over the stiffness", "[step]") {
    const double stiffness = GENERATE(1.0, 10.0, 100.0);
    CAPTURE(stiffness);
    const World world = worldOf(ball(10), ball(10), at(0, 25, 0));
    const TickRecord last = pressed(world, penalty(stiffness), at(0, 17, 0));
    // The device is 3 mm deep: the pair's spring and the coupling of 1 N/mm share this distance and carry the same
    // force.
    const double depth = 3 / (1 + stiffness), force = 3 - depth;
    CHECK(depth == Approx(force / stiffness));
    CHECK(last.X_WT.p.y() == Approx(20 - depth).margin(1e-5));
    CHECK(last.penetration == Approx(depth).margin(1e-5));
    CHECK(last.wrench_C.force.y() == Approx(force).margin(1e-5));
    CHECK(last.wrench_C.torque.norm() < 1e-6);
    CHECK(last.pairs == 1);
}

TEST_CASE("penalty: every pair has its own spring", "[step]") {
    // Two balls 20 mm apart, each on its own ball: twice the stiffness, half the depth each.
    const auto pair = treeOf({{-10, 0, 0, 5}, {10, 0, 0, 5}});
    const World world = worldOf(pair, pair, at(0, 15, 0));
    const TickRecord last = pressed(world, penalty(), at(0, 8, 0));
    CHECK(last.pairs == 2);
    CHECK(last.penetration == Approx(2.0 / 21).margin(1e-5));
    CHECK(last.wrench_C.force.y() == Approx(20 * 2.0 / 21).margin(1e-5));
}

TEST_CASE("penalty: with an off-center contact, forces and torques balance", "[step]") {
    // A rod that rests with its end on a ball turns until both springs balance.
    std::vector<Sphere> rod;
    for (int i = -10; i <= 10; ++i) rod.push_back({float(2 * i), 0, 0, 3});
    const World world = worldOf(treeOf(rod), ball(10), at(16, 14, 0));
    const TickRecord last = pressed(world, penalty(), at(16, 12, 0));
    REQUIRE(last.pairs >= 1);
    const Vec3 F = last.wrench_C.force, T = last.wrench_C.torque;
    CHECK(F.y() > 0.1);
    // The load acts near x = 0, at the ball: 16 mm from C.
    CHECK(-T.z() / F.y() == Approx(16).margin(1));
    CHECK(std::abs(T.y()) < 1e-3);
}

TEST_CASE("penalty: without an overlap the tool is at the device and there is no force", "[step]") {
    const World world = worldOf(blob(200, 20, 1), blob(200, 20, 2), at(0, 100, 0));
    TickState state(world);
    for (int tick = 0; tick < 100; ++tick) {
        const TickRecord r = step(world, penalty(), {at(0.1 * tick, 100, 0, Vec3(0, 1e-3 * tick, 0))}, state);
        REQUIRE(r.wrench_C.force.isZero(0));
        REQUIRE(r.wrench_C.torque.isZero(0));
        REQUIRE(r.X_WT.p == r.X_WT_device.p);
    }
}

TEST_CASE("penalty: no tick moves the tool by more than trust", "[step]") {
    const World world = worldOf(ball(10), ball(10), at(0, 50, 0));
    TickState state(world);
    Vec3 before = world.X_WT_start.p;
    for (int tick = 0; tick < 200; ++tick) {
        const TickRecord r = step(world, penalty(), {at(0, -50, 0)}, state);
        REQUIRE((r.X_WT.p - before).norm() <= penalty().trust + 1e-9);
        before = r.X_WT.p;
    }
}

TEST_CASE("penalty: the same motion gives the same bits with and without measurements", "[step]") {
    const World world = worldOf(blob(300, 20, 9), blob(300, 20, 10), at(0, 45, 0));
    const auto hashOf = [&](bool audit) {
        TickState state(world);
        std::uint64_t hash = 0;
        int pairs = 0;
        for (int tick = 0; tick < 500; ++tick) {
            const TickRecord r =
                step(world, penalty(), {at(std::sin(0.01 * tick), std::max(34.0, 45 - 0.05 * tick), 0)}, state,
                     {.audit = audit});
            hash = hashTick(r, hash);
            pairs += r.pairs;
        }
        REQUIRE(pairs > 0);
        return hash;
    };
    const std::uint64_t first = hashOf(false);
    CHECK(hashOf(false) == first);
    CHECK(hashOf(true) == first);
}

}  // namespace touchstone::penalty_mode_tests
