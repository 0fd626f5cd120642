// Obstacles that move against a tool with friction: with nothing behind it, the tool is carried.
#include <catch2/catch.hpp>

#include "haptics/loop/distances.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/qp/friction_table.hpp"
#include "tests/support/mesh_world.hpp"

namespace touchstone::pushed_tests {

using namespace touchstone::test;

namespace {

/// The tool, 4 mm high, 10 mm wide as a mesh and 12 mm as spheres, on a slab whose top is z = 0, and to the left of it
/// a wall that is 1 mm away.
World slabAndWall(Geometry geometry, double mu) {
    const Friction friction{mu, mu};
    if (geometry == Geometry::Mesh) {
        World world = meshWorld(centeredBox(10, 10, 4), boxMesh({100, 100, 6}, {-50, -50, -6}),
                                at(0, 0, 2 + Settings{}.contactDistance));
        const auto wall = std::make_shared<const Surface>(surfaceOf(boxMesh({6, 30, 30}, {-6, -15, -15})));
        world.obstacles.push_back({"wall", {.surface = wall, .spheres = ball(1)}, at(-6, 0, 2)});
        rub(world, friction);
        return world;
    }
    const auto feet = treeOf({{-4, -4, 0, 2}, {4, -4, 0, 2}, {-4, 4, 0, 2}, {4, 4, 0, 2}});
    World world = worldOf(feet, treeOf({{0, 0, -200, 200}}), at(0, 0, 2));
    world.obstacles.push_back({"wall", bySpheres(treeOf({{-200, 0, 0, 200}})), at(-7, 0, 2)});
    rub(world, friction);
    return world;
}

/// What the obstacles do, and how deep the device is pressed below the top of the slab meanwhile, mm.
struct Motion {
    const char* name;
    Vec3 slab, turn, wall;
    double press;
};

const Motion kMotions[] = {
    {"push", {0, 0, 4}, Vec3::Zero(), Vec3::Zero(), -0.5},
    {"lift", {0, 0, 4}, Vec3::Zero(), Vec3::Zero(), 2},
    {"oblique lift", {1, 2, 4}, Vec3::Zero(), Vec3::Zero(), 1},
    {"turn", Vec3::Zero(), {0.04, 0.02, 0.1}, Vec3::Zero(), 1},
    {"drag", {3, 1, 0}, Vec3::Zero(), Vec3::Zero(), 1},
    {"release", {0, 0, -4}, Vec3::Zero(), Vec3::Zero(), 1},
    {"two at once", {0, 0, 3}, Vec3::Zero(), {5, 0, 0}, 1},
};

}  // namespace

TEST_CASE("pushed: with friction a tool with nothing behind it gives way to whatever moves", "[step][friction]") {
    const Geometry geometry = GENERATE(Geometry::Mesh, Geometry::Spheres);
    const double mu = GENERATE(0.01, 0.4, 1.0);
    const double speed = GENERATE(0.0005, 0.5);  // mm a tick, far below and above what an obstacle moves at most
    const World world = slabAndWall(geometry, mu);
    const double kept = geometry == Geometry::Mesh ? Settings{}.contactDistance : 0;
    int held = 0;
    for (const Motion& motion : kMotions)
        for (const FrictionSolverInfo& solver : frictionSolverTable()) {
            if (mu != 0.4 && solver.name != kExactFrictionSolver) continue;
            Settings settings = settingsFor(geometry);
            settings.frictionSolver = solver.name;
            CAPTURE(geometryNames()[std::size_t(geometry)], mu, speed, motion.name, solver.name);
            const int ticks = speed < 0.01 ? 60 : 20;
            TickState state(world);
            const Pose device = at(0, 0, 2 - motion.press);
            TickRecord record;
            for (int tick = 0; tick < 20; ++tick) record = step(world, settings, {device}, state);
            // Contacts of the relaxation hover while they slide, so that they are where nothing touches.
            const bool relaxed = solver.law.hovers;
            const auto follow = [&](double share) {
                const std::vector<Pose> targets{
                    at(share * motion.slab.x(), share * motion.slab.y(), share * motion.slab.z(), share * motion.turn),
                    {world.obstacles[1].X_WO.p + share * motion.wall, Quat::Identity()}};
                record = step(world, settings, {device, state.nextMove(targets)}, state);
                held += !relaxed && (record.flags & kObstacleHeld) != 0;
                CHECK((record.flags & (kInfeasible | kNonFinite | kListOverflow)) == 0);
                return state.obstacles()[0] == targets[0] && state.obstacles()[1] == targets[1];
            };
            const double whole = std::min(1.0, speed * ticks / 5);  // of the motion, which is about 5 mm
            bool arrived = false;
            for (int tick = 1; tick <= ticks; ++tick) arrived = follow(whole * tick / ticks);
            for (int tick = 0; tick < 150 && !arrived; ++tick) arrived = follow(whole);
            for (int tick = 0; tick < 5; ++tick) follow(whole);
            CHECK(arrived);
            const double gap = trueClearance(world, record.X_WT, 1e3, state.obstacles(), geometry);
            const bool released = motion.slab.z() * whole < -motion.press || (motion.press < 0 && whole < 0.2);
            if (released)
                CHECK(record.wrench_C.isZero());
            else
                // A tenth of a micrometer, but for a solver that says that it is less accurate.
                CHECK(gap == Approx(kept).margin(relaxed ? mu * 0.5 : std::max(1e-4, solver.law.accuracy)));
        }
    // An obstacle waits a tick where no forces with friction were found: one between spheres, at 500 mm/s with mu 1.
    CHECK(held <= int(geometry == Geometry::Spheres && mu == 1.0 && speed == 0.5));
}

}  // namespace touchstone::pushed_tests
