// Starts at which parts touch or overlap: what only touches is felt from the first tick, what overlaps can be left.
#include <catch2/catch.hpp>

#include "haptics/loop/distances.hpp"
#include "haptics/loop/step.hpp"
#include "tests/support/mesh_world.hpp"

namespace touchstone::start_tests {

using namespace touchstone::test;

namespace {

constexpr double kDistance = 0.002, kPlay = 0.1;

/// A block of 40 x 40 x 28 mm with a square blind hole of this width, 20 mm deep, whose bottom is z = 0.
TriangleMesh blindHole(double width) {
    TriangleMesh m;
    const auto ring = [&](double half, double z) {
        for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
            m.vertices.push_back({half * x, half * y, z});
    };
    ring(20, -8), ring(20, 20), ring(width / 2, 20), ring(width / 2, 0);
    for (std::uint32_t k = 0; k < 12; k += 4)
        for (std::uint32_t i = 0; i < 4; ++i) {
            const std::uint32_t a = k + i, b = k + (i + 1) % 4;
            m.triangles.push_back({a, b, b + 4});
            m.triangles.push_back({a, b + 4, a + 4});
        }
    for (const auto& t : {std::array<std::uint32_t, 3>{0, 2, 1}, {0, 3, 2}, {12, 13, 14}, {12, 14, 15}})
        m.triangles.push_back(t);
    return m;
}

enum class Scene { One, Several, Assembled, Stacked };
enum class Way { Start, Reset, Restart, Moved };

Obstacle part(const TriangleMesh& mesh, const Pose& X_WO = {}) {
    return {"part", {.surface = std::make_shared<const Surface>(surfaceOf(mesh)), .spheres = ball(1)}, X_WO};
}

/// A square peg, 10 mm wide and 40 mm long, whose lower end meets obstacles at z = 0.
World pegOn(Scene scene, double mu, double play = kPlay) {
    World world = meshWorld(boxMesh({10, 10, 40}, {-5, -5, 0}), centeredBox(1, 1, 1), at(0, 0, 0));
    world.obstacles.clear();
    if (scene == Scene::One) world.obstacles = {part(boxMesh({60, 60, 6}, {-30, -30, -6}))};
    if (scene == Scene::Several)
        for (const double x : {-30.0, 0.0}) world.obstacles.push_back(part(boxMesh({30, 60, 6}, {x, -30, -6})));
    if (scene == Scene::Assembled) world.obstacles = {part(blindHole(10 + 2 * play))};
    if (scene == Scene::Stacked)
        world.obstacles = {part(boxMesh({60, 60, 6}, {-30, -30, -16})), part(boxMesh({20, 20, 10}, {-10, -10, -10})),
                           part(boxMesh({20, 20, 10}, {5, -10, 0}))};
    rub(world, {mu, mu});
    return world;
}

/// Begins with the peg's end at this height above the obstacles; returns where the peg is.
Pose begin(TickState& state, World& world, Way way, double gap, const Settings& settings) {
    Pose pose = at(0, 0, gap);
    if (way != Way::Start) {
        state.reset(at(0, 0, 30));
        for (int i = 0; i < 5; ++i) step(world, settings, {at(0, 0, 30 - 0.1 * i)}, state);
    }
    if (way == Way::Moved) {
        pose = at(0, 0, 3);
        std::vector<Pose> X_WO(world.obstacles.size(), at(0, 0, 3 - gap));
        state.begin({.X_WT = pose, .X_WT_device = pose}, X_WO);
    } else if (way == Way::Restart) {
        TickRecord last;
        last.tick = 5;
        last.X_WT = last.X_WT_device = pose;
        state.resume(last);
    } else {
        state.reset(pose);
    }
    return pose;
}

}  // namespace

TEST_CASE("start: parts that touch are felt from the first tick, and parts that overlap can be left", "[step]") {
    const Scene scene = GENERATE(Scene::One, Scene::Several, Scene::Assembled, Scene::Stacked);
    const Way way = GENERATE(Way::Start, Way::Reset, Way::Restart, Way::Moved);
    const double mu = GENERATE(0.0, 0.3);
    const Settings settings = settingsFor(Geometry::Mesh);
    for (const double gap : {1e-3, 0.0, -1e-6, -1e-3, -2e-3, -1e-2, -0.5}) {
        CAPTURE(int(scene), int(way), mu, gap);
        const bool touches = gap > -1.5 * kDistance;
        World world = pegOn(scene, mu);
        TickState state(world);
        const Pose start = begin(state, world, way, gap, settings);
        CHECK(startsInside(world, start, state.obstacles(), settings) == !touches);
        // At rest: led out at once by no more than it is inside and the distance that is kept, or not moved.
        TickRecord record = step(world, settings, {start}, state);
        CHECK(((record.flags & kOverlapping) == 0) == touches);
        const double moved = (record.X_WT.p - start.p).norm();
        const bool beside = scene == Scene::Stacked;  // it also touches the upper block, with a side
        const double most = std::hypot(touches * (kDistance - gap), beside * kDistance);
        CHECK(moved <= 1.2 * most + 1e-9);  // and what a turn adds at the node's origin
        if (touches)
            CHECK(trueClearance(world, record.X_WT, 1, state.obstacles(), Geometry::Mesh) >=
                  (gap > 0 ? 0.5 : 0.95) * kDistance - 1e-9);
        // Pressed down where it touches, and sideways: in a hole the walls are felt, whatever overlaps below.
        const auto lead = [&](const Vec3& from, const Vec3& to, int ticks) {
            Vec3 last = record.X_WT.p;
            for (int i = 1; i <= ticks; ++i) {
                const Vec3 p = from + (to - from) * (double(i) / ticks);
                record = step(world, settings, {Pose{start.p + p, Quat::Identity()}}, state);
                // Nothing throws the tool: it moves no farther than the device, and what a slip adds.
                CHECK((record.X_WT.p - last).norm() <= (to - from).norm() / ticks + settings.travelBudget + 1e-12);
                CHECK((record.flags & (kNonFinite | kListOverflow | kInfeasible)) == 0);
                last = record.X_WT.p;
            }
        };
        const Vec3 side(scene == Scene::Assembled ? 3 : 0, 0, 0);
        if (touches) {
            lead(Vec3::Zero(), Vec3(0, 0, -3), 30);
            CHECK(record.wrench_C.force.z() == Approx(3 - gap + kDistance).margin(2e-4));
            lead(Vec3(0, 0, -3), side + Vec3(0, 0, -3), 30);
            CHECK((record.flags & kOverlapping) == 0);
        } else if (scene == Scene::Assembled) {
            lead(Vec3::Zero(), side, 30);
            CHECK((record.flags & kOverlapping) != 0);
        }
        if (scene == Scene::Assembled)
            CHECK(record.wrench_C.force.x() == Approx(-(3 - kPlay + kDistance)).margin(touches ? 2e-4 : 2e-3));
        // Pulled out: nothing holds it but the friction of the wall.
        const Vec3 at = record.X_WT_device.p - start.p;
        lead(at, {at.x(), 0, 30}, 60);
        lead({at.x(), 0, 30}, {0, 0, 30}, 10);
        CHECK(record.wrench_C.isZero());
        CHECK(record.X_WT == record.X_WT_device);
        CHECK((record.flags & kOverlapping) == 0);
        // From then on everything is felt.
        lead({0, 0, 30}, {-2, 0, 30}, 10);
        if (scene != Scene::Assembled) {
            lead({-2, 0, 30}, {-2, 0, -3}, 90);
            CHECK(record.wrench_C.force.z() == Approx(3 - gap + kDistance).margin(2e-4));
        }
    }
}

TEST_CASE("start: a peg without play, or pressed in by some nanometers, can be pushed and pulled out", "[step]") {
    const double mu = GENERATE(0.0, 0.3);
    const double play = GENERATE(0.0, -1e-6, -5e-4, -1e-3);
    CAPTURE(mu, play);
    World world = pegOn(Scene::Assembled, mu, play);
    const Settings settings = settingsFor(Geometry::Mesh);
    TickState state(world);
    state.reset(at(0, 0, 0));
    TickRecord record;
    for (int i = 1; i <= 20; ++i) {
        record = step(world, settings, {at(0, 0, -0.1 * i)}, state);
        CHECK(record.X_WT.p.z() > -kDistance);
    }
    CHECK(record.wrench_C.force.z() == Approx(2).margin(2 * kDistance));
    for (int i = 1; i <= 60; ++i) record = step(world, settings, {at(0, 0, -2 + 0.5 * i)}, state);
    CHECK(record.wrench_C.isZero());
    CHECK(record.X_WT == record.X_WT_device);
}

TEST_CASE("start: between spheres what touches or overlaps is led out and felt", "[step]") {
    const auto feet = treeOf({{-4, -4, 0, 2}, {4, -4, 0, 2}, {-4, 4, 0, 2}, {4, 4, 0, 2}});
    const double mu = GENERATE(0.0, 0.3);
    World world = worldOf(feet, treeOf({{0, 0, -1000, 1000}}), at(0, 0, 2));
    rub(world, {mu, mu});
    const double touch = 2 - 16.0 / 1000;  // feet at 4 √2 mm from the axis: 2 - 32 / 2000
    for (const double gap : {1e-3, 0.0, -1e-6, -1e-3, -2e-3, -1e-2, -0.5}) {
        CAPTURE(mu, gap);
        TickState state(world);
        state.reset(at(0, 0, touch + gap));
        TickRecord record;
        for (int i = 0; i <= 20; ++i)
            record = step(world, settingsFor(Geometry::Spheres), {at(0, 0, touch - 0.1 * i)}, state);
        CHECK(record.wrench_C.force.z() == Approx(2).margin(1e-3));
        for (int i = 0; i < 20; ++i) record = step(world, settingsFor(Geometry::Spheres), {at(0, 0, 10)}, state);
        CHECK(record.wrench_C.isZero());
    }
}

}  // namespace touchstone::start_tests
