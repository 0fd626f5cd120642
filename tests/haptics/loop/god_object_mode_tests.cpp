// Compares god-object mode with answers derived by hand and with default mode between the same spheres.
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "haptics/loop/distances.hpp"
#include "haptics/loop/step.hpp"
#include "tests/support/mesh_world.hpp"
#include "tests/support/solvers.hpp"
#include "tests/support/sphere_models.hpp"

namespace touchstone::god_object_mode_tests {

using namespace touchstone::test;

namespace {

/// Distance up to which a pair touches, mm.
constexpr double kTouches = 1e-3;

Settings godObject() {
    Settings settings = settingsFor(Geometry::Spheres);
    settings.mode = Mode::GodObject;
    settings.shadow = kNoSolver;
    return settings;
}

/// The tick after a straight motion of the device to `end` and a rest of as many ticks.
TickRecord pressed(const World& world, const Settings& settings, const Pose& end, int ticks = 400) {
    TickState state(world);
    TickRecord record;
    for (int tick = 1; tick <= 2 * ticks; ++tick) {
        const double share = std::min(1.0, double(tick) / ticks);
        record = step(world, settings, {moved(world.X_WT_start, share * incrementBetween(world.X_WT_start, end))},
                      state, {.audit = true});
        REQUIRE(trueClearance(world, record.X_WT, 1, {}, Geometry::Spheres) > -1e-6);
    }
    return record;
}

}  // namespace

TEST_CASE("god object: a pressed ball rests where it touches", "[step]") {
    const World world = worldOf(ball(10), ball(10), at(0, 25, 0));
    const TickRecord last = pressed(world, godObject(), at(0, 17, 0));
    CHECK(last.X_WT.p.y() == Approx(20).margin(kTouches));
    CHECK(last.wrench_C.force.y() == Approx(3).margin(kTouches));
    CHECK(last.hover <= kTouches);
    CHECK(last.rows == 1);
    CHECK((last.flags & (kUnfinished | kInfeasible)) == 0);
}

TEST_CASE("god object: at rest it feels what default mode feels, with every solver", "[step]") {
    const World world = worldOf(blob(300, 20, 9), blob(300, 20, 10), at(0, 45, 0));
    const Pose end = at(2, 30, 1, {0.1, 0.2, 0.1});
    Settings settings = godObject();
    settings.mode = Mode::Default;
    const TickRecord expected = pressed(world, settings, end);
    REQUIRE(expected.wrench_C.force.norm() > 1);
    for (const std::string_view solver : allSolvers()) {
        CAPTURE(solver);
        settings = godObject();
        settings.solver = solver;
        settings.tolerance = 1e-4;
        settings.iterationCap = 20000;
        const TickRecord last = pressed(world, settings, end);
        CHECK((last.wrench_C.force - expected.wrench_C.force).norm() < 0.02);
        CHECK((last.wrench_C.torque - expected.wrench_C.torque).norm() < 0.3);
        CHECK(last.hover <= kTouches);
    }
}

TEST_CASE("god object: each new pair costs a step, so the tool falls behind where default mode does not", "[step]") {
    // Over the ripples of a slab, every ripple stops it.
    const World world = worldOf(slab(6, 3, 2), slab(12, 5, 3), at(-15, 8, 0));
    const auto forces = [&](Mode mode, int steps) {
        Settings settings = godObject();
        settings.mode = mode;
        settings.linearizations = steps;
        TickState state(world);
        std::vector<Vec3> all;
        for (int tick = 0; tick < 300; ++tick) {
            const double down = std::min(1.0, tick / 100.0), along = std::max(0.0, (tick - 100) / 200.0);
            const TickRecord r = step(world, settings, {at(-15 + 30 * along, 8 - 6 * down, 4 * along)}, state);
            REQUIRE(trueClearance(world, r.X_WT, 1, {}, Geometry::Spheres) > -1e-6);
            all.push_back(r.wrench_C.force);
        }
        return all;
    };
    const std::vector<Vec3> settled = forces(Mode::Default, 64);
    const auto error = [&](Mode mode) {
        const std::vector<Vec3> felt = forces(mode, 0);
        double sum = 0;
        for (std::size_t i = 0; i < felt.size(); ++i) sum += (felt[i] - settled[i]).norm();
        return sum / double(felt.size());
    };
    CHECK(error(Mode::GodObject) > 2 * error(Mode::Default));  // 3 times as large when this was written
}

TEST_CASE("god object: nothing tunnels, and free flight has no force", "[step]") {
    const World world = worldOf(ball(5), slab(30, 1.5f, 1), at(0, 30, 0));
    TickState state(world);
    for (const Pose& device : {at(1, 20, 0, {0, 0.4, 0}), at(0, 25, 1)}) {
        const TickRecord free = step(world, godObject(), {device}, state);
        CHECK(free.wrench_C.isZero());
        CHECK(free.flags == 0);
    }
    TickRecord last;
    for (int tick = 0; tick < 20; ++tick) last = step(world, godObject(), {at(0, -60, 0)}, state);
    CHECK(last.X_WT.p.y() > 5);
    CHECK(last.X_WT.p.y() < 6.1);
    for (int tick = 0; tick < 20; ++tick) last = step(world, godObject(), {at(0, 30, 0)}, state);
    CHECK(last.wrench_C.isZero());
}

TEST_CASE("god object: from an overlap the tool is led out by at most trust in a step", "[step]") {
    const World world = worldOf(ball(10), ball(10), at(0, 17, 0));
    const Settings settings = godObject();
    TickState state(world);
    double before = 17;
    for (int tick = 0; tick < 20; ++tick) {
        const TickRecord r = step(world, settings, {at(0, 17, 0)}, state, {.audit = true});
        const double y = r.X_WT.p.y();
        CHECK(r.penetration == Approx(std::max(0.0, 20 - y)).margin(1e-9));
        REQUIRE(y - before <= linearizationsOf(settings, Geometry::Spheres) * settings.trust + 1e-9);
        before = y;
    }
    CHECK(before == Approx(20).margin(kTouches));
}

TEST_CASE("god object: the same motion gives the same bits with and without measurements", "[step]") {
    const World world = worldOf(blob(300, 20, 9), blob(300, 20, 10), at(0, 45, 0));
    const auto hashOf = [&](bool audit, std::string_view shadow) {
        Settings settings = godObject();
        settings.shadow = shadow;
        TickState state(world);
        std::uint64_t hash = 0;
        int rows = 0, shadowRows = 0;
        for (int tick = 0; tick < 500; ++tick) {
            const Pose device = at(std::sin(0.01 * tick), std::max(34.0, 45 - 0.05 * tick), 0);
            const TickRecord r = step(world, settings, {device}, state, {.audit = audit});
            hash = hashTick(r, hash);
            rows += r.rows;
            shadowRows += r.shadowRows;
        }
        REQUIRE(rows > 0);
        CHECK((shadowRows > 0) == (shadow != kNoSolver));
        return hash;
    };
    const std::uint64_t first = hashOf(false, kNoSolver);
    CHECK(hashOf(true, kNoSolver) == first);
    CHECK(hashOf(true, "pqp") == first);
}

}  // namespace touchstone::god_object_mode_tests
