// Obstacles that move while ticks run: how they push the tool, and what holds them.
#include <catch2/catch.hpp>

#include "haptics/collision/pair_finder.hpp"
#include "haptics/loop/distances.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/loop/step.hpp"
#include "tests/support/alloc_count.hpp"
#include "tests/support/mesh_world.hpp"

namespace touchstone::obstacle_tests {

using namespace touchstone::test;

namespace {

constexpr double kMaxOverlap = 1e-3;  // mm: overlap that moving obstacles may cause; the tick itself allows half of it

Settings exactAlone() {
    Settings settings;
    settings.shadow = kNoSolver;
    return settings;
}

/// Ticks with the device at rest while obstacles move to their targets; calls check(record, X_WO) after each tick.
template <class Check>
TickRecord push(const World& world, const Settings& settings, const Pose& device, const std::vector<Pose>& targets,
                int ticks, Check&& check) {
    TickState state(world);
    TickRecord record;
    for (int tick = 0; tick < ticks; ++tick) {
        record = step(world, settings, {device, state.nextMove(targets)}, state, {.audit = true});
        check(record, state.obstacles());
    }
    return record;
}

double overlap(const World& world, const TickRecord& record, std::span<const Pose> X_WO) {
    return -trueClearance(world, record.X_WT, 0, X_WO);
}

/// Largest distance that a leaf of a tree moves between two poses, mm, computed leaf by leaf.
double farthestLeaf(const SphereTree& tree, const Pose& from, const Pose& to) {
    double most = 0;
    for (int i = 0; i < tree.leafCount(); ++i)
        most = std::max(most, (to * tree.leaf(i).center() - from * tree.leaf(i).center()).norm());
    return most;
}

/// Two bodies of about 20 mm radius that have leaves as well as meshes.
World bodies() {
    return withMeshes(worldOf(blob(300, 15, 6), blob(300, 20, 7), at(0, 45, 0)), blobMesh(15, 24, 13),
                      blobMesh(20, 22, 11));
}

}  // namespace

TEST_CASE("obstacles: a floor that rises under a resting tool lifts it without penetration", "[step][obstacle]") {
    const World world = worldOf(blob(200, 15, 1), slab(30, 2, 2), at(0, 18, 0));
    const double start = world.X_WT_start.p.y();
    Settings settings = exactAlone();
    settings.travelBudget = GENERATE(0.5, 0.02);  // the floor's motion adds to it
    const std::vector<Pose> risen{at(0, 10, 0)};
    int ticks = 0;
    const TickRecord last =
        push(world, settings, at(0, 14, 0), risen, 400, [&](const TickRecord& r, std::span<const Pose> X) {
            REQUIRE(overlap(world, r, X) <= kMaxOverlap);
            REQUIRE((r.flags & kListOverflow) == 0);
            ticks += !(X[0] == risen[0]);
        });
    CHECK(ticks < 60);  // 40 ticks at its greatest speed
    // The device pose is 4 mm below the start; the floor ends 10 mm higher.
    CHECK(last.X_WT.p.y() > start + 6);
    CHECK(last.wrench_C.force.y() == Approx(last.X_WT.p.y() - 14).epsilon(0.05));
}

TEST_CASE("obstacles: a turning obstacle from any side pushes the tool in free space", "[step][obstacle]") {
    const double rate = GENERATE(500.0, 1000.0, 4000.0);
    CAPTURE(rate);
    Settings settings = exactAlone();
    settings.rate = rate;
    const World world = worldOf(blob(300, 15, 2), blob(300, 20, 3), at(0, 60, 0));
    TickState state(world);
    // A blade sweeps twice through the place where the hand holds the tool, the second time in the other direction.
    const std::vector<Pose> way{at(0, 40, 10, Vec3(0, 0, 2)), at(0, 70, -30, Vec3(1, 0, 1)), at(0, 0, 0)};
    std::size_t leg = 0;
    bool pushed = false;
    Pose before = state.obstacles()[0];
    const double most = std::min(settings.trust / 2, 0.25 * 1000 / rate);
    const SphereTree& tree = *world.obstacles[0].part.spheres;
    int held = 0, ticks = 0;
    for (; ticks < 20'000 && leg < way.size(); ++ticks) {
        const TickRecord r =
            step(world, settings, {at(0, 60, 0), state.nextMove(std::span(&way[leg], 1))}, state, {.audit = true});
        const Pose now = state.obstacles()[0];
        REQUIRE(farthestLeaf(tree, before, now) <= most + 1e-9);
        REQUIRE(overlap(world, r, state.obstacles()) <= kMaxOverlap);
        pushed |= r.wrench_C.force.norm() > 1;
        held += (r.flags & kObstacleHeld) != 0;
        before = now;
        if (now == way[leg]) ++leg;
    }
    CAPTURE(ticks, held);
    CHECK(leg == way.size());  // nothing blocks the tool
    CHECK(pushed);
    CHECK(held < ticks / 20);
}

TEST_CASE("obstacles: a press stops at a tool that lies on another obstacle, and continues when it can",
          "[step][obstacle]") {
    const Settings settings = settingsFor(GENERATE(Geometry::Spheres, Geometry::Mesh));
    CAPTURE(getSetting(settings, "geometry"));
    const auto wall = slab(13, 2, 2);
    World world{bySpheres(ball(10)),
                {{"below", bySpheres(wall), at(0, -12, 0)}, {"above", bySpheres(wall), at(0, 14, 0)}},
                at(0, 0.1, 0)};
    world.tool.surface = std::make_shared<const Surface>(surfaceOf(centeredBox(12, 20, 12)));
    for (Obstacle& obstacle : world.obstacles)
        obstacle.part.surface = std::make_shared<const Surface>(surfaceOf(centeredBox(28, 4, 28)));
    const std::vector<Pose> closing{at(0, -12, 0), at(0, 8, 0)}, open{at(0, -20, 0), at(0, 8, 0)};
    TickState state(world);
    const auto run = [&](int ticks, const std::vector<Pose>& targets) {
        int held = 0;
        for (int tick = 0; tick < ticks; ++tick) {
            const TickRecord r = step(world, settings, {at(0, 0, 0), state.nextMove(targets)}, state, {.audit = true});
            if (settings.geometry == Geometry::Mesh) REQUIRE_FALSE(meshesOverlap(world, r.X_WT, state.obstacles()));
            if (settings.geometry == Geometry::Spheres) REQUIRE(overlap(world, r, state.obstacles()) <= kMaxOverlap);
            held += (r.flags & kObstacleHeld) != 0;
        }
        return held;
    };
    CHECK(run(300, closing) > 100);
    // It moves until the ball is pinched: 24 mm between the walls' centers, within the shortest move.
    CHECK(state.obstacles()[1].p.y() == Approx(12).margin(5e-3));
    CHECK(state.obstacles()[0] == closing[0]);

    // The floor retreats, and both arrive.
    run(300, open);
    CHECK(state.obstacles()[0] == open[0]);
    CHECK(state.obstacles()[1] == open[1]);
    CHECK(run(10, open) == 0);
}

TEST_CASE("obstacles: a held obstacle does not stop another", "[step][obstacle]") {
    const auto wall = slab(13, 2, 2);
    World world{bySpheres(ball(10)),
                {{"below", bySpheres(wall), at(0, -12, 0)},
                 {"above", bySpheres(wall), at(0, 12.1, 0)},
                 {"far", bySpheres(wall), at(80, 0, 0)}},
                {}};
    const std::vector<Pose> targets{at(0, -12, 0), at(0, 0, 0), at(60, 0, 0)};
    TickState state(world);
    for (int tick = 0; tick < 400; ++tick) step(world, exactAlone(), {at(0, 0, 0), state.nextMove(targets)}, state);
    CHECK(state.obstacles()[2] == targets[2]);
    CHECK(state.obstacles()[1].p.y() > 11.9);
}

TEST_CASE("obstacles: targets equal to the poses change no bit of a tick", "[step][obstacle]") {
    const Settings settings = settingsFor(GENERATE(Geometry::Spheres, Geometry::Mesh));
    const World world = bodies();
    const auto hash = [&](bool targetsGiven) {
        TickState state(world);
        std::vector<Pose> targets;
        for (const Obstacle& obstacle : world.obstacles) targets.push_back(obstacle.X_WO);
        if (!targetsGiven) targets.clear();
        std::uint64_t sum = 0;
        for (int tick = 0; tick < 300; ++tick)
            sum = hashTick(step(world, settings,
                                {at(0, std::max(33.0, 45 - 0.06 * tick), 0.01 * tick), state.nextMove(targets)}, state),
                           sum);
        return sum;
    };
    CHECK(hash(true) == hash(false));
}

TEST_CASE("obstacles: moving, pushing and holding allocate nothing", "[step][obstacle]") {
    const auto wall = slab(13, 2, 2);
    World world{bySpheres(blob(100, 10, 8)),
                {{"below", bySpheres(wall), at(0, -14, 0)}, {"above", bySpheres(wall), at(0, 16, 0)}},
                at(0, 0, 0)};
    const std::vector<Pose> targets{at(0, -10, 0, Vec3(0, 0, 0.1)), at(0, 6, 0)};
    TickState state(world);
    const AllocationCounter allocations;
    int held = 0;
    for (int tick = 0; tick < 400; ++tick)
        held += (step(world, {}, {at(0, 0, 0), state.nextMove(targets)}, state).flags & kObstacleHeld) != 0;
    CHECK(allocations.count() == 0);
    CHECK(held > 0);
}

TEST_CASE("obstacles: paper mode uses their present poses", "[step][obstacle]") {
    const World world = worldOf(ball(10), ball(10), at(0, 25, 0));
    Settings settings = exactAlone();
    settings.mode = Mode::Paper;
    const TickRecord last = push(world, settings, at(0, 25, 0), {at(0, 6, 0)}, 400, [](auto&, auto) {});
    // Like a tool pressed 1 mm deep into a fixed ball: at rest they touch, with 20 mm between the centers.
    CHECK(last.X_WT.p.y() == Approx(26).margin(1e-6));
    CHECK(last.wrench_C.force.y() == Approx(1).margin(1e-6));
}

TEST_CASE("obstacles: a pause and a device without a pose hold them", "[step][obstacle]") {
    const World world = worldOf(ball(10), ball(10), at(0, 25, 0));
    const std::vector<Pose> targets{at(0, 3, 0)};
    TickState state(world);
    Settings paused = exactAlone();
    paused.pause = true;
    step(world, paused, {at(0, 25, 0), state.nextMove(targets)}, state);
    step(world, exactAlone(), {{Vec3(NAN, 0, 0), Quat::Identity()}, state.nextMove(targets)}, state);
    CHECK(state.obstacles()[0] == world.obstacles[0].X_WO);
    const std::vector<Pose> nowhere{{Vec3(0, NAN, 0), Quat::Identity()}};
    step(world, exactAlone(), {at(0, 25, 0), state.nextMove(nowhere)}, state);
    CHECK(state.obstacles()[0] == world.obstacles[0].X_WO);
    step(world, exactAlone(), {at(0, 25, 0), state.nextMove(targets)}, state);
    CHECK(state.obstacles()[0].p.y() == Approx(0.25));
}

}  // namespace touchstone::obstacle_tests
