// Compares the tick with answers that follow from the geometry.
#include "haptics/loop/distances.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/loop/step.hpp"

#include <catch2/catch.hpp>
#include <random>

#include "tests/support/alloc_count.hpp"
#include "tests/support/mesh_world.hpp"
#include "tests/support/solvers.hpp"

namespace touchstone::step_tests {

using namespace touchstone::test;

namespace {

Settings exactAlone() {
    Settings settings;
    settings.shadow = kNoSolver;
    return settings;
}

/// Two bodies of about 20 mm radius that have leaves as well as meshes.
World bodies() {
    return withMeshes(worldOf(blob(300, 20, 7), blob(300, 20, 8), at(0, 45, 0)), blobMesh(20, 24, 13),
                      blobMesh(20, 22, 11));
}

/// Steps along a motion, given as one pose for each tick, and calls check(record) after each tick.
template <class Motion, class Check>
TickRecord drive(const World& world, const Settings& settings, int ticks, Motion&& motion, Check&& check) {
    TickState state(world);
    TickRecord record;
    for (int tick = 0; tick < ticks; ++tick) {
        record = step(world, settings, {motion(tick)}, state, {.audit = true});
        check(record);
    }
    return record;
}

}  // namespace

TEST_CASE("step: a ball pressed into a ball stops at the surface and pushes back with k times the depth", "[step]") {
    const World world = worldOf(ball(10), ball(10), at(0, 25, 0));
    const auto press = [](int tick) { return at(0, std::max(17.0, 25 - 0.05 * tick), 0); };
    const TickRecord last = drive(world, exactAlone(), 400, press, [&](const TickRecord& r) {
        REQUIRE(trueClearance(world, r.X_WT) >= -1e-3);
        REQUIRE((r.flags & ~(kUnfinished | kCapped)) == 0);
    });
    // Centers 20 apart, device at 17: 3 mm at 1 N/mm along y. The contact carries no torque.
    REQUIRE(last.X_WT.p.y() == Approx(20).margin(1e-3));
    REQUIRE(last.wrench_C.force.y() == Approx(3).margin(1e-3));
    REQUIRE(last.wrench_C.torque.norm() < 1e-6);
    REQUIRE(last.hover < 1e-3);
    REQUIRE(last.rows == 1);
}

TEST_CASE("step: in free motion the force is exactly zero and the tool is exactly at the device pose", "[step]") {
    const Geometry geometry = GENERATE(Geometry::Spheres, Geometry::Mesh);
    World world = bodies();
    world.X_WT_start = at(0, 100, 0);
    // 5 m/s past the obstacle at a distance, turning.
    drive(
        world, settingsFor(geometry), 100,
        [](int tick) { return at(5.0 * tick - 250, 60, 0, Vec3(0, 0.05 * tick, 0)); },
        [](const TickRecord& r) {
            REQUIRE(r.wrench_C.force.isZero(0));
            REQUIRE(r.wrench_C.torque.isZero(0));
            REQUIRE(r.flags == 0);
            REQUIRE((r.X_WT.p - r.X_WT_device.p).norm() < 1e-12);
        });
}

TEST_CASE("step: nothing tunnels through a thin slab at any speed", "[step]") {
    const double speed = GENERATE(0.2, 1.0, 10.0, 50.0);  // mm per tick: m/s
    CAPTURE(speed);
    const World world = worldOf(ball(12), slab(24, 2, 1.2f), at(0, 40, 0));
    const TickRecord last = drive(
        world, exactAlone(), int(100 / speed) + 30,
        [&](int tick) { return at(0.3, std::max(-60.0, 40 - speed * tick), 0.1); },
        [&](const TickRecord& r) { REQUIRE(trueClearance(world, r.X_WT) >= -1e-3); });
    REQUIRE(last.X_WT.p.y() > 12);
    REQUIRE(last.wrench_C.force.y() > 60);
}

TEST_CASE("step: a rod turned in contact never penetrates, and the lever gives torque about C", "[step]") {
    std::vector<Sphere> rod;
    for (int i = -10; i <= 10; ++i) rod.push_back({float(2 * i), 0, 0, 3});
    const World world = worldOf(treeOf(rod), ball(10), at(15, 13.5, 0));
    // The rod lies on the ball 15 mm off its center and is pushed down and turned.
    const TickRecord last = drive(
        world, exactAlone(), 600,
        [](int tick) { return at(15, 13.5 - 0.005 * std::min(tick, 400), 0, Vec3(0, 2e-4 * tick, 0)); },
        [&](const TickRecord& r) { REQUIRE(trueClearance(world, r.X_WT) >= -1e-3); });
    const Vec3 f = last.wrench_C.force;
    REQUIRE(f.y() > 0.1);
    // One ball carries the whole load. Its force acts at a point below the rod, so the torque about C is perpendicular
    // to it.
    REQUIRE(std::abs(last.wrench_C.torque.dot(f)) < 1e-3 * f.norm() * last.wrench_C.torque.norm() + 1e-6);
    REQUIRE(last.wrench_C.torque.norm() > 1);
}

TEST_CASE("step: the wrench about the node's origin is the wrench about C, shifted", "[step]") {
    // The tool's tree is 30 mm from its node, so C and o differ.
    const World world = worldOf(treeOf({{30, 0, 0, 10}}), ball(10), at(-30, 25, 0));
    const TickRecord last = drive(
        world, exactAlone(), 300, [](int tick) { return at(-30, std::max(18.0, 25 - 0.05 * tick), 0); }, [](auto&) {});
    REQUIRE(last.wrench_C.force.y() == Approx(2).margin(2e-3));
    REQUIRE(last.wrench_C.torque.norm() < 1e-6);
    // p_C - p_o = (30, 0, 0); (30,0,0) x (0,2,0) = (0,0,60).
    REQUIRE(last.wrench_o.torque.z() == Approx(60).margin(0.06));
    REQUIRE(last.wrench_o.force == last.wrench_C.force);
}

TEST_CASE("step: a pinched ball gets no deeper than at the start, and the flags say that rows contradict", "[step]") {
    const double overlap = GENERATE(0.05, 0.1, 0.5);
    CAPTURE(overlap);
    // Walls above and below, each `overlap` into a ball of 10 mm.
    const auto wall = slab(13, 2, 2);
    World world{
        bySpheres(ball(10)),
        {{"below", bySpheres(wall), at(0, -12 + overlap, 0)}, {"above", bySpheres(wall), at(0, 12 - overlap, 0)}},
        at(0, 0, 0)};
    const double given = -trueClearance(world, world.X_WT_start);
    REQUIRE(given == Approx(overlap).margin(1e-5));  // spheres are stored in float
    bool infeasible = false;
    drive(
        world, exactAlone(), 300,
        [](int tick) { return at(0, 2 * std::sin(0.05 * tick), 0.5 * std::sin(0.02 * tick)); },
        [&](const TickRecord& r) {
            REQUIRE(-trueClearance(world, r.X_WT) <= given + 1e-3);
            infeasible |= (r.flags & kInfeasible) != 0;
        });
    REQUIRE(infeasible);
}

TEST_CASE("step: a tool that starts in penetration never gets deeper, and leaves where it can", "[step]") {
    // Two shells whose rows mostly oppose each other, and a ball in a slab, which only needs to rise.
    const bool hasWayOut = GENERATE(false, true);
    const World world = hasWayOut ? worldOf(ball(12), slab(24, 2, 1.2f), at(0, 12, 0))
                                  : worldOf(blob(400, 20, 3), blob(400, 20, 4), at(0, 30, 0));
    double depth = -trueClearance(world, world.X_WT_start);
    REQUIRE(depth > 0.8);
    drive(
        world, exactAlone(), 200, [&](int) { return world.X_WT_start; },
        [&](const TickRecord& r) {
            const double now = -trueClearance(world, r.X_WT);
            REQUIRE(now <= std::max(depth, 0.0) + 1e-3);
            depth = now;
        });
    if (hasWayOut) REQUIRE(depth <= 1e-3);
}

TEST_CASE("step: the travel budget bounds how fast a loaded tool may move", "[step]") {
    const World world = worldOf(ball(10), slab(9, 3, 3), at(0, 14, 0));
    const Settings settings = exactAlone();
    // Pressed down 8 mm near the edge and pulled over it: the tool drops, but by no more than the hand's travel plus
    // v·dt.
    Pose before = world.X_WT_start, deviceBefore = before;
    bool loaded = false;
    drive(
        world, settings, 900,
        [](int tick) { return at(std::max(0.0, 0.05 * (tick - 300)), std::max(5.0, 14 - 0.05 * tick), 0); },
        [&](const TickRecord& r) {
            const double traveled = (r.X_WT.p - before.p).norm(), hand = (r.X_WT_device.p - deviceBefore.p).norm();
            if (loaded) REQUIRE(traveled <= hand + settings.travelBudget + 1e-9);
            loaded = r.wrench_C.force.norm() > 0;
            before = r.X_WT;
            deviceBefore = r.X_WT_device;
        });
}

TEST_CASE("step: a device that jumps out of contact takes the tool along, and no force remains", "[step]") {
    const World world = worldOf(blob(600, 20, 5), blob(600, 20, 6), at(0, 45, 0));
    const Settings settings = exactAlone();
    TickState state(world);
    TickRecord r;
    for (int tick = 0; tick < 400; ++tick)
        r = step(world, settings, {at(0, std::max(28.0, 45 - 0.05 * tick), 0)}, state);
    const double pressed = r.wrench_C.force.norm();
    REQUIRE(pressed > 3);

    SECTION("nothing blocks the path") {
        r = step(world, settings, {at(0, 90, 0)}, state);
        REQUIRE(r.wrench_C.force.norm() < 1e-9);
        REQUIRE(r.linearizations <= 32);
    }
    SECTION("only a turn") {
        const Pose before = r.X_WT;
        const Pose out = at(0, 90, 0, Vec3(0, 0.5, 0));
        const double hand = 62 + world.reach() * 0.5 + 1;  // C may be about 0.1 mm from the node's origin
        r = step(world, settings, {out}, state);
        REQUIRE(r.wrench_C.force.norm() < 1e-9);
        REQUIRE((r.X_WT.p - before.p).norm() <= hand);
    }
    SECTION("the obstacle blocks the path") {
        const Pose before = r.X_WT;
        r = step(world, settings, {at(0, -60, 0)}, state);
        REQUIRE((r.X_WT.p - before.p).norm() <= 2 * settings.trust + 1e-9);
        REQUIRE(r.linearizations == 2);
        REQUIRE(trueClearance(world, r.X_WT) >= -1e-3);
        REQUIRE(r.wrench_C.force.norm() > 80);
    }
    SECTION("it moves out slowly, without a jump") {
        for (int tick = 0; tick < 100; ++tick) {
            r = step(world, settings, {at(0, 28 + 0.5 * tick, 0)}, state);
            REQUIRE(r.linearizations <= (r.wrench_C.force.isZero(0) ? 64 : 2));
        }
        REQUIRE(r.wrench_C.force.isZero(0));
    }
}

TEST_CASE("step: deep overlaps are solved with few rows, and the answer is that of all rows", "[step]") {
    // 3,000 spheres against 3,000, 10 mm deep: tens of thousands of pairs.
    const World world = worldOf(blob(3000, 20, 3), blob(3000, 20, 4), at(0, 30, 0));
    Settings settings = exactAlone(), all = exactAlone();
    all.adaptiveMargin = false;
    all.margin = all.trust = settings.margin = settings.trust = 0.1;  // all pairs within this margin fit into the rows
    TickState few(world), full(world);
    double depth = -trueClearance(world, world.X_WT_start);
    REQUIRE(depth > 3);
    int solved = 0;
    for (int tick = 0; tick < 30; ++tick) {
        const Pose device = at(0.05 * tick, 30 + 0.1 * tick, 0);
        const TickRecord a = step(world, settings, {device}, few), b = step(world, all, {device}, full);
        CAPTURE(tick, a.pairs, a.rows, b.rows, a.linearizations, a.flags, b.flags);
        REQUIRE(b.rowsTruncated == 0);
        REQUIRE(a.rowsTruncated == 0);
        REQUIRE(a.pairs > 4096);
        REQUIRE(a.rows < 4096);
        REQUIRE(a.linearizations <= 10);
        REQUIRE((a.flags & kInfeasible) != 0);
        REQUIRE((a.X_WT.p - b.X_WT.p).norm() < 1e-6);
        const double now = -trueClearance(world, a.X_WT);
        REQUIRE(now <= depth + 1e-3);
        depth = now;
        solved += a.rows;
    }
    REQUIRE(solved > 0);
}

TEST_CASE("step: the penetration meter equals the overlap of the true clearance to the last bit", "[step]") {
    const World world{bySpheres(blob(300, 20, 5)),
                      {{"a", bySpheres(blob(300, 20, 6))}, {"b", bySpheres(ball(10)), at(30, 0, 0)}},
                      at(0, 60, 0)};
    PenetrationMeter meter(world);
    int deep = 0, free = 0;
    // In and out, so that it reaches shallow and deep poses from both directions.
    for (int tick = 0; tick < 200; ++tick) {
        const Pose X = at(5 * std::sin(0.3 * tick), 37 + 5 * std::sin(0.1 * tick), 2, Vec3(0, 0.02 * tick, 0));
        const double expected = std::max(0.0, -trueClearance(world, X, 0));
        REQUIRE(meter.depth(X) == expected);
        deep += expected > 0.1;
        free += expected == 0;
    }
    REQUIRE(deep > 20);
    REQUIRE(free > 20);
}

TEST_CASE("step: the adaptive margin changes the number of rows, but no answer within trust", "[step]") {
    const World world = worldOf(blob(600, 20, 5), blob(600, 20, 6), at(0, 45, 0));
    Settings adaptive = exactAlone(), full = exactAlone();
    full.adaptiveMargin = false;
    TickState a(world), b(world);
    long rowsAdaptive = 0, rowsFull = 0;
    int reached = 0;
    for (int tick = 0; tick < 600; ++tick) {
        const Pose device = at(4 * std::sin(0.01 * tick), std::max(30.0, 45 - 0.05 * tick), 0,
                               Vec3(0, 0.2 * std::sin(0.013 * tick), 0));
        const TickRecord r = step(world, adaptive, {device}, a), s = step(world, full, {device}, b);
        rowsAdaptive += r.rows;
        rowsFull += s.rows;
        b.resume(r);
        if (r.flags & kCapped) continue;  // steps limited by trust may differ
        ++reached;
        REQUIRE((r.X_WT.p - s.X_WT.p).norm() < 1e-7);
    }
    REQUIRE(reached > 400);
    REQUIRE(rowsAdaptive < rowsFull / 2);
}

TEST_CASE("step: results do not depend on the shadow, the timer, the audit or the age of the lists", "[step]") {
    const Geometry geometry = GENERATE(Geometry::Spheres, Geometry::Mesh);
    CAPTURE(geometryNames()[std::size_t(geometry)]);
    const World world = bodies();
    const auto device = [](int tick) {
        return at(3 * std::sin(0.02 * tick), std::max(28.0, 45 - 0.06 * tick), 0,
                  Vec3(0.1 * std::sin(0.01 * tick), 0, 0));
    };
    const auto hashOf = [&](const Settings& settings, const StageClock& clock, bool audit) {
        TickState state(world);
        std::uint64_t hash = hashTick({});
        TickRecord record;
        for (int tick = 0; tick < 500; ++tick)
            hash =
                hashTick(record = step(world, settings, {device(tick)}, state, {.clock = clock, .audit = audit}), hash);
        REQUIRE(record.wrench_C.force.norm() > 5);
        return hash;
    };
    static std::uint64_t counter = 0;
    const StageClock clock{[] { return counter += 7; }, 1e-3};
    Settings plain = settingsFor(geometry);
    Settings shadowed = plain, fresh = plain;
    shadowed.shadow = "pqp";
    fresh.slack = 0.0;  // a new list for every linearization
    REQUIRE(hashOf(plain, {}, false) == hashOf(plain, {}, false));
    REQUIRE(hashOf(plain, {}, false) == hashOf(shadowed, clock, true));
    REQUIRE(hashOf(plain, {}, false) == hashOf(fresh, {}, false));
    // An audit runs an exact solver beside an approximate one.
    for (const std::string_view solver : approximateSolvers()) {
        Settings approximate = plain;
        approximate.solver = solver;
        approximate.tolerance = 0.1;
        CAPTURE(solver);
        REQUIRE(hashOf(approximate, {}, false) == hashOf(approximate, clock, true));
    }
}

TEST_CASE("step: entries from another thread change no result, at any pose and width", "[step]") {
    const World world = worldOf(blob(300, 20, 7), blob(300, 20, 8), at(0, 45, 0));
    LeafPairFinder finder(*world.tool.spheres, *world.obstacles[0].part.spheres);
    PairEntries entries(*world.tool.spheres, *world.obstacles[0].part.spheres);
    const PairEntries* offered[] = {&entries};
    const Settings settings = exactAlone();
    TickState plain(world), helped(world);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    int complete = 0;
    for (int tick = 0; tick < 500; ++tick) {
        const Pose device =
            at(3 * std::sin(0.02 * tick), std::max(28.0, 45 - 0.06 * tick), 0, Vec3(0.1 * std::sin(0.01 * tick), 0, 0));
        const TickRecord expected = step(world, settings, {device}, plain);
        if (tick % 3 == 0) {  // so that entries of several ages are used
            const Pose off{Vec3(uniform(random), uniform(random), uniform(random)), Quat::Identity()};
            REQUIRE(finder.find({off * expected.X_WT, 1.5 + uniform(random)}, entries));
            complete += finder.reserve(entries, {expected.X_WT, 0}) > 0;
        }
        REQUIRE(hashTick(step(world, settings, {device}, helped, {.entries = offered})) == hashTick(expected));
    }
    REQUIRE(complete > 50);
}

TEST_CASE("step: the tick allocates nothing, in any mode, with every solver", "[step]") {
    const World world = bodies();
    const auto [mode, geometry] = GENERATE(table<Mode, Geometry>({{Mode::Default, Geometry::Mesh},
                                                                  {Mode::Default, Geometry::Spheres},
                                                                  {Mode::Paper, Geometry::Spheres},
                                                                  {Mode::Penalty, Geometry::Spheres},
                                                                  {Mode::GodObject, Geometry::Spheres}}));
    for (const std::string_view solver : allSolvers()) {
        CAPTURE(int(mode), int(geometry), solver);
        TickState state(world);
        Settings settings = settingsFor(geometry);
        settings.mode = mode;
        settings.solver = solver;
        settings.shadow = solver == kExactSolver ? Settings().shadow : kExactSolver;
        AllocationCounter counter;
        for (int tick = 0; tick < 400; ++tick)
            step(world, settings, {at(0, std::max(30.0, 45 - 0.06 * tick), 0)}, state, {.audit = true});
        REQUIRE(counter.count() == 0);
    }
}

TEST_CASE("step: a state resumed from a record gives the answers of the uninterrupted one", "[step]") {
    const Settings settings = settingsFor(GENERATE(Geometry::Spheres, Geometry::Mesh));
    CAPTURE(getSetting(settings, "geometry"));
    const World world = bodies();
    const auto device = [](int tick) {
        return at(3 * std::sin(0.02 * tick), std::max(28.0, 45 - 0.06 * tick), 0,
                  Vec3(0.1 * std::sin(0.01 * tick), 0, 0));
    };
    TickState going(world), resumed(world);
    TickRecord last = step(world, settings, {device(0)}, going);
    int loaded = 0;
    for (int tick = 1; tick < 500; ++tick) {
        resumed.resume(last);
        const TickRecord r = step(world, settings, {device(tick)}, resumed);
        last = step(world, settings, {device(tick)}, going);
        CAPTURE(tick, r.flags, last.flags);
        REQUIRE(r.tick == last.tick);
        // Both are exact to 1e-9 of a step below a millimeter, in up to 64 linearizations.
        REQUIRE((r.X_WT.p - last.X_WT.p).norm() < 1e-7);
        loaded += last.wrench_C.force.norm() > 0.1;
    }
    REQUIRE(loaded > 100);
}

TEST_CASE("step: bad input holds the tool without force until valid input returns", "[step]") {
    const World world = worldOf(ball(10), ball(10), at(0, 25, 0));
    TickState state(world);
    const Settings settings = exactAlone();
    for (int tick = 0; tick < 200; ++tick) step(world, settings, {at(0, std::max(18.0, 25 - 0.05 * tick), 0)}, state);
    const TickRecord before = step(world, settings, {at(0, 18, 0)}, state);
    const double bad = GENERATE(std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity());
    const TickRecord during = step(world, settings, {at(bad, 18, 0)}, state);
    REQUIRE((during.flags & kBadInput) != 0);
    REQUIRE(during.wrench_C.force.isZero(0));
    REQUIRE(during.X_WT.p == before.X_WT.p);
    const TickRecord zero = step(world, settings, {{Vec3(0, 18, 0), Quat(0, 0, 0, 0)}}, state);
    REQUIRE((zero.flags & kBadInput) != 0);
    const TickRecord after = step(world, settings, {at(0, 18, 0)}, state);
    REQUIRE(after.flags == 0);
    REQUIRE(after.wrench_C.force.y() == Approx(2).margin(1e-3));
}

TEST_CASE("step: pause holds the tool and gives no force", "[step]") {
    const World world = worldOf(ball(10), ball(10), at(0, 25, 0));
    TickState state(world);
    Settings settings = exactAlone();
    settings.pause = true;
    const TickRecord r = step(world, settings, {at(0, 18, 0)}, state);
    REQUIRE(r.flags == kPaused);
    REQUIRE(r.X_WT.p.y() == 25);
    REQUIRE(r.wrench_C.force.isZero(0));
}

TEST_CASE("step: no solver's answer lets the tool penetrate, at any tolerance", "[step]") {
    const double tolerance = GENERATE(1.0, 0.1, 1e-3);
    const std::string_view solver = GENERATE(from_range(allSolvers()));
    CAPTURE(tolerance, solver);
    const Geometry geometry = GENERATE(Geometry::Spheres, Geometry::Mesh);
    const World world = bodies();
    Settings settings = settingsFor(geometry);
    settings.solver = solver;
    settings.tolerance = tolerance;
    const Pose X_WO = world.obstacles[0].X_WO;
    drive(
        world, settings, 500,
        [](int tick) { return at(3 * std::sin(0.02 * tick), std::max(30.0, 45 - 0.06 * tick), 0); },
        [&](const TickRecord& r) {
            if (geometry == Geometry::Mesh) REQUIRE_FALSE(meshesOverlap(world, r.X_WT, {&X_WO, 1}));
            if (geometry == Geometry::Spheres) REQUIRE(trueClearance(world, r.X_WT) >= -1e-3);
        });
}

TEST_CASE("step: an approximate solver gets only the rows that screening keeps, and the tool does not penetrate",
          "[step]") {
    const World world = worldOf(blob(3000, 20, 11), blob(3000, 20, 12), at(0, 45, 0));
    const auto screening = GENERATE(Screening::None, Screening::Screen, Screening::Cluster);
    const std::string_view solver = GENERATE(from_range(approximateSolvers()));
    CAPTURE(int(screening), solver);
    Settings settings = exactAlone();
    settings.solver = solver;
    settings.tolerance = 1e-4;
    settings.iterationCap = 100'000;
    settings.adaptiveMargin = false;
    settings.margin = 1;
    settings.screening = screening;
    long rows = 0, left = 0, inexact = 0;
    double error = 0;
    TickState reference(world);
    Settings exactly = settings;
    exactly.solver = exactAlone().solver;
    drive(
        world, settings, 500,
        [](int tick) { return at(3 * std::sin(0.02 * tick), std::max(30.0, 45 - 0.06 * tick), 0); },
        [&](const TickRecord& r) {
            REQUIRE(trueClearance(world, r.X_WT) >= -1e-3);
            REQUIRE(r.rowsScreened <= r.rows);
            rows += r.rows;
            left += r.rowsScreened;
            inexact += r.screenInexact;
            const TickRecord exact = step(world, exactly, {r.X_WT_device}, reference);
            // On the way to a place, ticks of two answers may be at different points of it.
            const bool arrived = ((r.flags | exact.flags) & kUnfinished) == 0;
            if (arrived && r.screenInexact == 0)
                error = std::max(error, (exact.wrench_C.force - r.wrench_C.force).norm());
        });
    CAPTURE(rows, left, inexact, error);
    REQUIRE(rows > 5000);
    if (screening == Screening::None) {
        REQUIRE(left == rows);
        REQUIRE(inexact == 0);
    } else {
        REQUIRE(2 * left < rows);
        REQUIRE(inexact > 0);
    }
    if (screening == Screening::Screen) REQUIRE(error < 0.05);
}

TEST_CASE("step: the error of the shadow is measured on the rows that screening kept", "[step]") {
    const World world = worldOf(blob(3000, 20, 13), blob(3000, 20, 14), at(0, 45, 0));
    Settings settings;
    settings.shadow = GENERATE(from_range(approximateSolvers()));
    settings.tolerance = 1e-5;
    settings.iterationCap = 1'000'000;
    settings.adaptiveMargin = false;
    settings.margin = 1;
    settings.screening = Screening::Cluster;
    int cut = 0;
    drive(
        world, settings, 400, [](int tick) { return at(0, std::max(32.0, 45 - 0.06 * tick), 0); },
        [&](const TickRecord& r) {
            cut += r.shadowRowsCut;
            REQUIRE(r.shadowForceError < 1e-3);  // small although clusters are not exact
        });
    REQUIRE(cut > 1000);
}

TEST_CASE("step: the shadow's error is relative to the exact answer on the same rows", "[step]") {
    const World world = worldOf(blob(300, 20, 13), blob(300, 20, 14), at(0, 45, 0));
    const std::string_view shadow = GENERATE(from_range(approximateSolvers()));
    const auto worst = [&](double tolerance) {
        Settings settings;
        settings.shadow = shadow;
        settings.tolerance = tolerance;
        settings.iterationCap = 1'000'000;
        double error = 0;
        drive(
            world, settings, 400, [](int tick) { return at(0, std::max(32.0, 45 - 0.06 * tick), 0); },
            [&](const TickRecord& r) { error = std::max(error, r.shadowForceError); });
        return error;
    };
    const double coarse = worst(1), fine = worst(1e-4);
    REQUIRE(coarse > 0.01);
    REQUIRE(fine < coarse / 20);
}

TEST_CASE("step: paper mode keeps the paper's first-order distance of a ball on a ball", "[step]") {
    const World world = worldOf(ball(10), ball(10), at(0, 25, 0));
    Settings settings = exactAlone();
    settings.mode = Mode::Paper;
    // At rest at depth 1 the fixed point of the linearized quadratic constraint is contact: 20 mm between the centers.
    const TickRecord last = drive(
        world, settings, 400, [](int tick) { return at(0, std::max(19.0, 25 - 0.02 * tick), 0); }, [](auto&) {});
    REQUIRE(last.pairs == 1);
    REQUIRE(last.X_WT.p.y() == Approx(20).margin(1e-6));
    REQUIRE(last.wrench_C.force.y() == Approx(1).margin(1e-6));
}

TEST_CASE("step: paper mode's residuals are in mm of the contact, not in its squared distance", "[step]") {
    // After one tick 1 mm deep with one iteration of PQP, part of the 1 mm remains. As squared distance it would be 40
    // times as large: the length of the row's gradient 2|d| with 20 mm between the centers.
    const World world = worldOf(ball(10), ball(10), at(0, 20, 0));
    Settings settings = exactAlone();
    settings.mode = Mode::Paper;
    settings.solver = "pqp";
    settings.paperWork = 1;
    settings.tolerance = 1e9;
    TickState state(world);
    const TickRecord r = step(world, settings, {at(0, 19, 0)}, state);
    REQUIRE(r.rows == 1);
    REQUIRE(r.kkt.primal_mm > 0.1);
    REQUIRE(r.kkt.primal_mm <= 1 + 1e-9);
}

TEST_CASE("step: paper mode keeps the deepest rows and counts the rest", "[step]") {
    const World world = worldOf(blob(300, 20, 15), blob(300, 20, 16), at(0, 45, 0));
    Settings settings = exactAlone();
    settings.mode = Mode::Paper;
    settings.paperRows = 50;
    TickState state(world);
    const TickRecord r = step(world, settings, {at(0, 20, 0)}, state);
    REQUIRE(r.pairs > 50);
    REQUIRE(r.rows == 50);
    REQUIRE(r.rowsTruncated == r.pairs - 50);
    REQUIRE((r.flags & kRowsTruncated) != 0);
}

TEST_CASE("step: with more pairs than rows the nearest are kept, the others counted, and no overlap grows", "[step]") {
    // 300 spheres against 300, all within reach of each other: 90,000 pairs for 32,768 rows.
    const World world = worldOf(blob(300, 1, 17), blob(300, 1, 18), at(0, 1, 0));
    const double given = -trueClearance(world, world.X_WT_start);
    Settings settings = exactAlone();
    settings.margin = settings.trust = 5;
    settings.adaptiveMargin = false;
    TickState state(world);
    const TickRecord r = step(world, settings, {at(0, 0.5, 0)}, state);
    REQUIRE((r.flags & kRowsTruncated) != 0);
    REQUIRE(r.rowsTruncated == 90'000 - 300);
    REQUIRE(-trueClearance(world, r.X_WT) <= given + 1e-3);
}

TEST_CASE("step: with more pairs than the list holds, the tool is held with zero force", "[step]") {
    // 4,096 leaves against 512 buckets, all within reach: two million entries for 2^18.
    const World world = worldOf(blob(4096, 1, 19), blob(4096, 1, 20), at(0, 1, 0));
    Settings settings = exactAlone();
    settings.margin = settings.trust = 5;
    settings.adaptiveMargin = false;
    TickState state(world);
    const TickRecord r = step(world, settings, {at(0, 0.5, 0)}, state);
    REQUIRE((r.flags & kListOverflow) != 0);
    REQUIRE(r.wrench_C.force.isZero(0));
    REQUIRE((r.X_WT.p - world.X_WT_start.p).norm() < 1e-12);
}

}  // namespace touchstone::step_tests
