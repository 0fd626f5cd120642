// The tick between meshes, judged by answers that follow from the geometry and by the reference.
#include <catch2/catch.hpp>

#include "haptics/loop/distances.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/math/statistics.hpp"
#include "haptics/reference/mesh_reference.hpp"
#include "haptics/surface/feature_pair_finder.hpp"
#include "tests/support/alloc_count.hpp"
#include "tests/support/mesh_world.hpp"
#include "tests/support/wandering_hand.hpp"

namespace touchstone::mesh_step_tests {

using namespace touchstone::test;

namespace {

constexpr double kDistance = 0.002;

Settings meshes() { return settingsFor(Geometry::Mesh); }

}  // namespace

TEST_CASE(
    "mesh step: a box pressed onto a box stops at the distance that is kept and pushes back with k times the depth",
    "[step]") {
    const World world = meshWorld(centeredBox(4, 4, 4), centeredBox(10, 10, 6), at(0.3, -0.2, 9));
    TickState state(world);
    TickRecord record;
    for (int tick = 0; tick < 400; ++tick) {
        record = step(world, meshes(), {at(0.3, -0.2, std::max(3.0, 9 - 0.05 * tick))}, state, {.audit = true});
        REQUIRE((record.flags & ~(kUnfinished | kCapped)) == 0);
        REQUIRE(record.X_WT.p.z() >= 5 + kDistance / 2);
    }
    CHECK(record.X_WT.p.z() == Approx(5 + kDistance).margin(1e-9));
    CHECK(record.wrench_C.force.z() == Approx(2 + kDistance).margin(1e-9));
    CHECK(record.wrench_C.force.head<2>().norm() < 1e-9);
    CHECK(record.wrench_C.torque.norm() < 1e-6);
    CHECK(record.hover == Approx(kDistance).margin(1e-9));
    CHECK(record.touching.count >= 2);  // the others of the four corners need no row, since the answer crosses none
    // A device that leaps away is followed in one tick, without any force.
    record = step(world, meshes(), {at(0.3, -0.2, 40)}, state);
    CHECK(record.X_WT == at(0.3, -0.2, 40));
    CHECK(record.wrench_C.isZero());
}

TEST_CASE("mesh step: a tool slides after a device that leapt as far as a tick may work", "[step]") {
    const World world = meshWorld(centeredBox(4, 4, 4), centeredBox(60, 10, 6), at(0, 0, 6));
    TickState state(world);
    TickRecord record;
    for (int tick = 0; tick < 100; ++tick) record = step(world, meshes(), {at(0, 0, 6 - 0.02 * tick)}, state);
    REQUIRE(record.wrench_C.force.z() > 0.9);
    record = step(world, meshes(), {at(20, 0, 4)}, state);
    CHECK(record.X_WT.p.x() > 0.25);
    CHECK(record.X_WT.p.x() < 20);
    CHECK(record.hover == Approx(kDistance).margin(1e-6));
    CHECK((record.flags & kUnfinished) != 0);
    for (int tick = 0; tick < 60; ++tick) record = step(world, meshes(), {at(20, 0, 4)}, state);
    CHECK((record.flags & kUnfinished) == 0);
    CHECK(record.X_WT.p.x() == Approx(20).margin(1e-6));
}

TEST_CASE("mesh step: a tool that the travel budget slows down keeps to the surface", "[step]") {
    // A box rocks from one of its edges to the other. The way from one contact straight to the next leads over the
    // plate.
    const World world = meshWorld(centeredBox(10, 4, 4), centeredBox(30, 30, 6), at(0, 0, 6));
    TickState state(world);
    Settings settings = meshes();
    TickRecord record;
    for (int tick = 0; tick < 100; ++tick) record = step(world, settings, {at(0, 0, 4.5, Vec3(0, 0.04, 0))}, state);
    REQUIRE((record.flags & kUnfinished) == 0);
    const double far = record.wrench_C.torque.y();
    settings.travelBudget = 0.05;
    int slowed = 0;
    double lowest = record.wrench_C.force.z();
    for (int tick = 0; tick < 20; ++tick) {
        record = step(world, settings, {at(0, 0, 4.5, Vec3(0, -0.04, 0))}, state, {.audit = true});
        slowed += (record.flags & kCapped) != 0;
        lowest = std::min(lowest, record.wrench_C.force.z());
        CAPTURE(tick, record.hover);
        CHECK(record.hover <= 2 * kDistance);
        CHECK((record.flags & kHalved) == 0);
    }
    CHECK(slowed >= 3);
    CHECK(lowest > 0.4);
    CHECK((record.flags & kUnfinished) == 0);
    CHECK(record.wrench_C.torque.y() == Approx(-far).margin(1e-3));
}

TEST_CASE("mesh step: a tick ends when its next step would be too short to be felt", "[step]") {
    // Two blobs, of which one slides around the other. Each pose of the device is rendered until nothing moves.
    const World world = meshWorld(blobMesh(4, 120, 60), blobMesh(5, 140, 70), at(0, 0, 14));
    const Settings settings = meshes();
    const double turn = GENERATE(0.003, 0.01);  // rad from pose to pose
    CAPTURE(turn);
    TickState state(world);
    int linearizations = 0;
    std::vector<double> left;  // mm that the tool moves after the tick
    for (int pose = 0; pose < 600; ++pose) {
        const double angle = turn * pose;
        const Pose device = at(7 * std::cos(angle), 0, 7 * std::sin(angle), Vec3(0.1 * std::sin(2 * angle), 0, angle));
        const TickRecord first = step(world, settings, {device}, state);
        TickRecord rest = first;
        for (int tick = 0; tick < 5; ++tick) rest = step(world, settings, {device}, state);
        if (pose < 20 || (first.flags & kUnfinished) != 0) continue;
        REQUIRE(first.wrench_C.force.norm() > 0.1);
        linearizations += first.linearizations;
        left.push_back((rest.X_WT.p - first.X_WT.p).norm());
    }
    REQUIRE(left.size() > 500);
    CAPTURE(linearizations, left.size(), *percentile(left, 95), *percentile(left, 99));
    // Ticks that make every step take 2.7 and 3.1 linearizations. A tool that is left farther is in a shallow valley.
    CHECK(linearizations < (turn < 0.005 ? 2.4 : 2.9) * double(left.size()));
    CHECK(*percentile(left, 95) < 2e-4);
    CHECK(*percentile(left, 99) < 0.005);
}

TEST_CASE("mesh step: a tick ends when its rows become too many, and the next one goes on", "[step]") {
    const bool many = GENERATE(true, false);
    const auto round = [](double a, double t) { return Vec3(3 * std::cos(a), 3 * std::sin(a), 4 * t); };
    const World world = meshWorld(lathe(many ? 2500 : 250, 2, 0, 4, round), centeredBox(10, 10, 6), at(0, 0, 3.2));
    TickState state(world);
    const Pose device = at(0.4, 0, 2.5, Vec3(0, 0, 0.1));
    TickRecord record = step(world, meshes(), {device}, state);
    CAPTURE(record.rows, record.linearizations);
    CHECK((record.rows > 2048) == many);
    CHECK(((record.flags & kUnfinished) != 0) == many);
    for (int tick = 0; tick < 20; ++tick) record = step(world, meshes(), {device}, state);
    CHECK((record.flags & kUnfinished) == 0);
    CHECK((record.X_WT.p - Vec3(0.4, 0, 3 + kDistance)).norm() < 1e-3);
}

TEST_CASE("mesh step: nothing tunnels and nothing overlaps, whatever the hand does, and rests are the reference's",
          "[step][reference]") {
    struct Case {
        const char* name;
        TriangleMesh tool, obstacle;
        double size;
    };
    const std::vector<Case> cases{
        {"box and thin plate", centeredBox(5, 4, 3), centeredBox(30, 30, 0.2), 6},
        {"blob and blob", blobMesh(4, 24, 13), blobMesh(5, 22, 11), 6},
        {"bar in a ring", centeredBox(3, 3, 16), torusMesh(5, 2, 30, 14), 4},
        {"cylinder and box", cylinderMesh(3, 6), centeredBox(7, 6, 5), 5},
        {"needle and ball", centeredBox(0.4, 0.3, 12), sphereMesh(4, 30, 15), 5},
        {"tiny and large", centeredBox(0.5, 0.4, 0.3), torusMesh(6, 3, 40, 20), 6},
    };
    const auto which = GENERATE(range(0, 6));
    const Case& c = cases[which];
    CAPTURE(c.name);
    const World world = meshWorld(c.tool, c.obstacle, at(0, 0, 30));
    const MeshReference judge(c.tool, world.p_TC(), {{c.obstacle, Pose{}}}, {.shell = kDistance});
    TickState state(world);
    WanderingHand hand(unsigned(40 + which), c.size);
    const Settings settings = meshes();
    Pose device;
    int loaded = 0, compared = 0, agreed = 0;
    for (int tick = 0; tick < 3000; ++tick) {
        device = hand.next();
        const TickRecord record = step(world, settings, {device}, state);
        REQUIRE((record.flags & (kInfeasible | kNonFinite | kListOverflow | kOverlapping)) == 0);
        REQUIRE(!meshesOverlap(world, record.X_WT, state.obstacles()));
        loaded += !record.wrench_C.isZero();
        if (tick % 100 != 99 || record.wrench_C.isZero() || (record.flags & kUnfinished)) continue;
        const MeshReferenceAnswer answer = judge.solve({device, record.X_WT, settings.stiffness, settings.torsion});
        if (!answer.converged) continue;
        ++compared;
        agreed += (answer.wrench_C.force - record.wrench_C.force).norm() < 0.005;
    }
    CHECK(loaded > 500);
    CHECK(compared >= 5);
    CHECK(agreed + 1 + compared / 10 >=
          compared);  // a row of an early trial may hold the tool where its pair no longer meets
}

TEST_CASE("mesh step: entries from another thread and the reserve of the lists change no result", "[step]") {
    const World world = meshWorld(blobMesh(4, 24, 13), torusMesh(6, 2, 28, 14), at(0, 0, 30));
    FeaturePairFinder finder(*world.tool.surface, *world.obstacles[0].part.surface);
    PairEntries entries = finder.entries();
    const PairEntries* offered[] = {&entries};
    TickState plain(world), helped(world);
    WanderingHand hand(3, 5);
    const Settings settings = meshes();
    Random random(8);
    int complete = 0, allocated = 0;
    for (int tick = 0; tick < 1200; ++tick) {
        const Pose device = hand.next();
        const AllocationCounter counter;
        const TickRecord expected = step(world, settings, {device}, plain);
        allocated += int(counter.count());
        if (tick % 3 == 0) {
            const Pose off{0.3 * random.vector(), Quat::Identity()};
            if (finder.find({off * expected.X_WT, 1.5}, entries))
                complete += finder.reserve(entries, {expected.X_WT, 0}) > 0;
        }
        REQUIRE(hashTick(step(world, settings, {device}, helped, {.entries = offered})) == hashTick(expected));
    }
    CHECK(complete > 100);
    CHECK(allocated == 0);
}

TEST_CASE("mesh step: the pairs that carried the tool are tried first, also by a state that is resumed", "[step]") {
    // The end of a cylinder lies on a box, so that many pairs touch; few of them carry it.
    const World world = meshWorld(cylinderMesh(3, 4), centeredBox(30, 30, 30), at(0, 0, 20));
    const Settings settings = meshes();
    TickState going(world), resumed(world), bare(world), foreign(world);
    TickRecord last;
    for (int tick = 0; tick < 200; ++tick)
        last = step(world, settings, {at(0.1, 0, std::max(14.0, 20 - 0.1 * tick))}, going);
    REQUIRE(last.wrench_C.force.z() > 0.5);
    REQUIRE(last.touching.count >= 1);
    int fewer = 0;
    for (int tick = 0; tick < 50; ++tick) {
        const TickInput input{at(0.1 + 0.02 * tick, 0, 14, {0, 0, 0.001 * tick})};
        TickRecord without = last;
        without.touching.clear();
        resumed.resume(last);
        bare.resume(without);
        // Pairs that the world does not have, as a broken file may name, are left out.
        TickRecord wild = without;
        for (const std::uint64_t id : {~0ull, 1ull << 56, 0x3ull << 54, 0xfffffffull, (2ull << 54) + 0xfffff})
            wild.touching.push(id);
        foreign.resume(wild);
        last = step(world, settings, input, going);
        CAPTURE(tick, last.rows);
        const TickRecord again = step(world, settings, input, resumed), slow = step(world, settings, input, bare);
        CHECK((again.X_WT.p - last.X_WT.p).norm() < 1e-7);
        CHECK(again.rows == last.rows);
        CHECK(hashTick(step(world, settings, input, foreign)) == hashTick(slow));
        // The answers differ by what a tick does not resolve.
        CHECK((slow.X_WT.p - last.X_WT.p).norm() < 0.001);
        fewer += last.rows < slow.rows;
    }
    CHECK(fewer > 40);
}

TEST_CASE("mesh step: a start inside an obstacle is noticed, and touches once it is out", "[step]") {
    const World world = meshWorld(centeredBox(2, 2, 2), centeredBox(20, 20, 20), at(0, 0, 5));
    TickState state(world);
    const Settings settings = meshes();
    double out = 0;
    for (int tick = 0; tick < 400; ++tick) {
        const double z = 5 + 0.05 * tick;
        const TickRecord record = step(world, settings, {at(0, 0, z)}, state);
        CHECK(record.wrench_C.isZero());
        CHECK(record.X_WT == at(0, 0, z));
        if (std::abs(z - 11) > 1e-6) CHECK(((record.flags & kOverlapping) != 0) == (z < 11));
        out = z;
    }
    REQUIRE(out > 20);
    TickRecord back;
    for (int tick = 0; tick < 400; ++tick)
        back = step(world, settings, {at(0, 0, std::max(8.0, out - 0.1 * tick))}, state);
    CHECK(back.X_WT.p.z() == Approx(11 + kDistance).margin(1e-6));
    CHECK(back.wrench_C.force.z() == Approx(3 + kDistance).margin(1e-6));
}

TEST_CASE("mesh step: a moving obstacle pushes the tool and never enters it", "[step]") {
    const World world = meshWorld(blobMesh(3, 18, 9), torusMesh(6, 2, 26, 12), at(0, 0, 8));
    TickState state(world);
    Random random(12);
    Pose target;
    int pushed = 0, moved = 0;
    Pose before;
    for (int tick = 0; tick < 2500; ++tick) {
        if (tick % 120 == 0) target = {1.5 * random.vector() + Vec3(0, 0, 3), expRotation(0.4 * random.vector())};
        const TickInput input{at(0, 0, 4), state.nextMove({&target, 1})};
        const TickRecord record = step(world, meshes(), input, state);
        REQUIRE(!meshesOverlap(world, record.X_WT, state.obstacles()));
        pushed += !record.wrench_C.isZero();
        moved += !(state.obstacles()[0] == before);
        before = state.obstacles()[0];
    }
    CHECK(pushed > 300);
    CHECK(moved > 300);
}

TEST_CASE("mesh step: spheres and meshes can be exchanged while the loop runs", "[step]") {
    World world = meshWorld(centeredBox(4, 4, 4), centeredBox(10, 10, 6), at(0, 0, 9));
    TickState state(world);
    Settings settings = meshes();
    TickRecord record;
    for (int tick = 0; tick < 300; ++tick) {
        settings.geometry = tick / 60 % 2 ? Geometry::Spheres : Geometry::Mesh;
        record = step(world, settings, {at(0, 0, std::max(4.0, 9 - 0.05 * tick))}, state);
        REQUIRE((record.flags & kBadInput) == 0);
    }
    // The trees are unit balls at the centers: between them nothing touches at 4 mm, and the boxes overlap then.
    CHECK((record.flags & kOverlapping) != 0);
    CHECK(record.wrench_C.isZero());
}

TEST_CASE("penetration meter: an obstacle of spheres is measured beside one of meshes that has no tree", "[step]") {
    World world = meshWorld(centeredBox(4, 4, 4), centeredBox(10, 10, 6), at(0, 0, 9));
    world.obstacles[0].part.spheres = nullptr;
    world.obstacles.push_back({.name = "open", .part = bySpheres(ball(1)), .X_WO = at(0, 0, 20)});
    PenetrationMeter meter(world);
    CHECK(meter.depth(at(0, 0, 9), {}, Geometry::Mesh) == 0);
    CHECK(meter.depth(at(0, 0, 18.5), {}, Geometry::Mesh) == Approx(0.5));  // of balls of 1 mm
}

}  // namespace touchstone::mesh_step_tests
