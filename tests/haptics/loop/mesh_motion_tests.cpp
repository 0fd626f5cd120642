// Motions that are hard between meshes: thin walls, high speeds, rests, other rates, settings that change meanwhile.
#include <catch2/catch.hpp>

#include "haptics/loop/step.hpp"
#include "tests/support/mesh_world.hpp"
#include "tests/support/wandering_hand.hpp"

namespace touchstone::mesh_motion_tests {

using namespace touchstone::test;

namespace {

const Vec3 kTurn(0.3, -0.4, 0.2);

/// A ball with a cavity.
TriangleMesh shell(double radius, double wall) {
    return joined(sphereMesh(radius), flipped(sphereMesh(radius - wall)));
}

/// Moves the device at `speed` mm a tick along the way and lets it rest at its end; checks that nothing overlaps and
/// calls check(record) in each tick. Returns the last record.
template <class Check>
TickRecord drive(const World& world, const Settings& settings, const std::vector<Vec3>& way, double speed,
                 Check&& check) {
    TickState state(world);
    Pose device = world.X_WT_start;
    TickRecord record;
    const auto tick = [&] {
        record = step(world, settings, {device}, state);
        CAPTURE(record.tick, record.flags, device.p.transpose());
        REQUIRE((record.flags & (kInfeasible | kNonFinite | kListOverflow | kOverlapping)) == 0);
        REQUIRE_FALSE(meshesOverlap(world, record.X_WT, state.obstacles()));
        check(record);
    };
    for (const Vec3& to : way) {
        const Vec3 from = device.p;
        const int ticks = int(std::ceil((to - from).norm() / speed));
        for (int i = 1; i <= ticks; ++i) {
            device.p = from + (to - from) * (double(i) / ticks);
            tick();
        }
        for (int i = 0; i < 30; ++i) tick();
    }
    return record;
}

}  // namespace

TEST_CASE("mesh motion: nothing tunnels through a plate of 10 µm at any speed", "[step]") {
    const double speed = GENERATE(0.2, 1.0, 3.0, 10.0, 50.0);  // mm per tick: m/s
    const Vec3 turn = GENERATE(Vec3(Vec3::Zero()), Vec3(kTurn));
    CAPTURE(speed, turn.transpose());
    const World world = meshWorld(centeredBox(5, 4, 3), centeredBox(200, 200, 0.01), at(1, 2, 15, turn));
    const TickRecord last = drive(world, settingsFor(Geometry::Mesh), {{1, 2, -40}}, speed,
                                  [](const TickRecord& r) { REQUIRE(r.X_WT.p.z() > 1.4); });
    CHECK(last.wrench_C.force.z() > 40);
}

TEST_CASE("mesh motion: a thin shell keeps in what is inside and out what is outside, at any speed", "[step]") {
    const double speed = GENERATE(0.2, 1.0, 10.0, 50.0);
    CAPTURE(speed);
    const std::vector<Vec3> way{{40, 5, -10}, {-30, 20, 0}, {0, -3, 50}, {0, 0, 0}};
    const Settings settings = settingsFor(Geometry::Mesh);
    double pressed = 0;
    const auto stays = [&](bool isIn) {
        return [&pressed, isIn](const TickRecord& r) {
            REQUIRE((r.X_WT.p.norm() < 10) == isIn);
            pressed = std::max(pressed, r.wrench_C.force.norm());
        };
    };
    const TriangleMesh body = centeredBox(4, 3, 2), thin = shell(10, 0.05);
    SECTION("a body in a shell") {
        drive(meshWorld(body, thin, at(0, 0, 0, kTurn)), settings, way, speed, stays(true));
    }
    SECTION("a shell around a body") { drive(meshWorld(thin, body, at(0, 0, 0)), settings, way, speed, stays(true)); }
    SECTION("a body outside") {
        drive(meshWorld(body, thin, at(30, 5, -5, kTurn)), settings, {{-10, 2, 0}, {0, 15, 0}, {0, 0, 0}}, speed,
              stays(false));
    }
    CHECK(pressed > 8);
}

TEST_CASE("mesh motion: while the device rests the force is constant, at any rate", "[step]") {
    Settings settings = settingsFor(Geometry::Mesh);
    settings.rate = GENERATE(500.0, 1000.0, 10000.0);
    CAPTURE(settings.rate);
    const bool onRing = GENERATE(true, false);
    const World world =
        meshWorld(blobMesh(4, 24, 13), onRing ? torusMesh(6, 2, 28, 14) : blobMesh(5, 22, 11), at(0, 0, 30));
    TickState state(world);
    Random random(4);
    int loaded = 0, unfinished = 0;
    double most = 0;
    for (int rest = 0; rest < 30; ++rest) {
        const Pose device = random.pose(onRing ? 3 : 4, 0.7);
        TickRecord record;
        // A device that leapt is followed by up to 0.5 mm a ms and 1 mm a tick.
        for (int tick = 0; tick < std::max(300.0, 0.1 * settings.rate); ++tick)
            record = step(world, settings, {device}, state);
        if (record.wrench_C.isZero()) continue;
        ++loaded;
        for (int tick = 0; tick < 50; ++tick) {
            const TickRecord next = step(world, settings, {device}, state);
            unfinished += (next.flags & kUnfinished) != 0;
            most = std::max(most, (next.wrench_C.force - record.wrench_C.force).norm());
            record = next;
        }
    }
    CHECK(loaded > 12);
    CHECK(unfinished == 0);
    CHECK(most < 1e-12);  // N: only rounding, of sums of a few mm
}

TEST_CASE("mesh motion: the rate changes no rest", "[step]") {
    const World world = meshWorld(centeredBox(4, 4, 4), centeredBox(10, 10, 6), at(0.3, -0.2, 6));
    for (const double rate : {500.0, 1000.0, 10000.0}) {
        Settings settings = settingsFor(Geometry::Mesh);
        settings.rate = rate;
        const TickRecord last = drive(world, settings, {{0.3, -0.2, 3}}, 50 / rate, [](const TickRecord&) {});
        CHECK(last.wrench_C.force.z() == Approx(2 + settings.contactDistance).margin(1e-9));
    }
}

TEST_CASE("mesh motion: nothing overlaps at any rate, nor while settings change", "[step]") {
    const World world = meshWorld(blobMesh(4, 24, 13), torusMesh(6, 2, 28, 14), at(0, 0, 30));
    const char* what = GENERATE("rate", "stiffness", "linearizations", "travel_budget", "solver", "slack", "pause",
                                "contact_distance");
    CAPTURE(what);
    const std::vector<const char*> values = [&]() -> std::vector<const char*> {
        const std::string_view key = what;
        if (key == "rate") return {"10000", "500", "1000"};
        if (key == "stiffness") return {"5", "0.1", "1"};
        if (key == "linearizations") return {"1", "8", "4"};
        if (key == "travel_budget") return {"0.02", "5", "0.5"};
        if (key == "solver") return {"pqp", "active-set", "dual-active-set"};
        if (key == "slack") return {"0", "2", "0.1"};
        if (key == "pause") return {"on", "off"};
        return {"0.02", "0.002", "0.0005"};
    }();
    TickState state(world);
    Settings settings = settingsFor(Geometry::Mesh);
    WanderingHand hand(7, 5);
    int loaded = 0;
    for (int tick = 0; tick < 600; ++tick) {
        if (tick % 40 == 0) REQUIRE(setSetting(settings, what, values[std::size_t(tick / 40) % values.size()]) == "");
        const TickRecord record = step(world, settings, {hand.next()}, state);
        CAPTURE(tick, record.flags);
        REQUIRE((record.flags & (kNonFinite | kListOverflow | kOverlapping)) == 0);
        REQUIRE_FALSE(meshesOverlap(world, record.X_WT, state.obstacles()));
        loaded += !record.wrench_C.isZero();
    }
    CHECK(loaded > 150);
}

}  // namespace touchstone::mesh_motion_tests
