// An invalid pose (non-finite, beyond 1 km, or not a rotation) holds the tool and gives exactly zero force until valid
// poses return, whatever its source.
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <functional>

#include "haptics/device/control.hpp"
#include "haptics/device/device_table.hpp"
#include "haptics/hands/hand_table.hpp"
#include "haptics/hands/held_motion.hpp"
#include "haptics/hands/mouse.hpp"
#include "haptics/loop/distances.hpp"
#include "haptics/loop/tick_driver.hpp"
#include "tests/support/any_number.hpp"
#include "tests/support/ground_world.hpp"
#include "tests/support/mesh_world.hpp"

namespace touchstone::bad_pose_tests {

using test::AnyNumber;
using test::at;

namespace {

const double kBeyond = std::nextafter(kLargestCoordinate, HUGE_VAL);

/// Invalid poses, in each coordinate.
std::vector<Pose> badPoses() {
    std::vector<Pose> bad;
    for (const double far : {kBeyond, 1e7, 1e15, 1e30, 1e150, 1e308, std::numeric_limits<double>::max(), HUGE_VAL,
                             std::numeric_limits<double>::quiet_NaN()})
        for (int axis = 0; axis < 3; ++axis)
            for (const double sign : {1.0, -1.0}) {
                bad.push_back(at(0, 18, 0));
                bad.back().p[axis] = sign * far;
            }
    for (const double length : {0.0, 1e-200, 0.4, 2.1, 1e30, 1e200, HUGE_VAL}) {
        bad.push_back(at(0, 18, 0, {0.3, 0.2, 0.1}));
        bad.back().q.coeffs() *= length;
    }
    return bad;
}

/// Requires that every number of a record is finite and that no pose in it is far away.
void requireFinite(const TickRecord& r) {
    REQUIRE((r.X_WT.p.array().abs() <= 1.001 * kLargestCoordinate).all());
    REQUIRE((r.X_WT_device.p.array().abs() <= 1.001 * kLargestCoordinate).all());
    REQUIRE(r.X_WT.q.coeffs().allFinite());
    REQUIRE(r.X_WT_device.q.coeffs().allFinite());
    for (const Wrench* wrench : {&r.wrench_C, &r.wrench_o, &r.wrench_out}) REQUIRE(wrench->isFinite());
    for (const double x : {r.hover, r.penetration, r.marginUsed, r.projection, r.kkt.primal_mm, r.kkt.dual_N,
                           r.kkt.stationarity_N, r.kkt.complementarity_mJ})
        REQUIRE(std::isfinite(x));
}

bool isZero(const Wrench& wrench) { return wrench.force.isZero(0) && wrench.torque.isZero(0); }

/// A ball of 10 mm on another, or a cube of 20 mm as the meshes: they touch when the tool is at y = 20 mm.
World balls() {
    const TriangleMesh cube = test::centeredBox(20, 20, 20);
    return test::withMeshes(test::worldOf(test::ball(10), test::ball(10), at(0, 25, 0)), cube, cube);
}

Settings settingsOf(Mode mode, Geometry geometry = Geometry::Spheres) {
    Settings settings = test::settingsFor(geometry);
    settings.mode = mode;
    return settings;
}

/// Every mode, and default mode in both geometries.
struct Way {
    Mode mode;
    Geometry geometry;
};
const std::vector<Way> kWays{{Mode::Default, Geometry::Mesh},
                             {Mode::Default, Geometry::Spheres},
                             {Mode::Paper, Geometry::Spheres},
                             {Mode::Penalty, Geometry::Spheres},
                             {Mode::GodObject, Geometry::Spheres}};

using Script = std::function<DeviceReading(int call)>;

class ScriptedDevice final : public Device {
  public:
    explicit ScriptedDevice(Script script) : script_(std::move(script)) {}
    DeviceReading read(double, double) noexcept override { return script_(call_++); }
    void write(const Wrench& wrench) noexcept override { felt = wrench; }
    DeviceLimits limits() const noexcept override { return {.peakForce = 1000, .peakTorque = 1e4, .motors = false}; }
    Wrench felt;

  private:
    Script script_;
    int call_ = 0;
};

/// A run with the given device, 3 mm above the ground, which the tool touches at y = 5 mm.
struct Run {
    TickDriver driver;

    explicit Run(std::unique_ptr<Device> device)
        : driver(std::make_unique<Session>(test::groundBelow(), Settings{}, std::move(device))) {}
    TickRecord ticks(int n) {
        TickRecord last;
        for (int i = 0; i < n; ++i) requireFinite(last = driver.tick());
        return last;
    }
    const SafetyStage& safety() const { return driver.session().safety; }
};

std::vector<MotionKey> motionThrough(const Pose& bad) {
    return {{0, at(0, 8, 0)}, {100, at(0, 3, 0)}, {200, bad}, {201, bad}, {202, at(0, 3, 0)}, {300, at(0, 3, 0)}};
}

}  // namespace

TEST_CASE("pose: valid within a kilometer, with a quaternion that can be normalized", "[step]") {
    for (const Pose& bad : badPoses()) {
        CAPTURE(bad.p.transpose(), bad.q.coeffs().transpose());
        CHECK_FALSE(bad.isValid());
    }
    CHECK(Pose{}.isValid());
    CHECK(at(1e6, -1e6, 1e6, {1, 2, 3}).isValid());
    CHECK(at(std::numeric_limits<double>::denorm_min(), -0.0, 0).isValid());
    Pose rounded = at(1, 2, 3, {0.3, 0.2, 0.1});
    rounded.q.coeffs() *= GENERATE(0.6, 1 - 1e-7, 1.9);
    CHECK(rounded.isValid());
}

TEST_CASE("step: an invalid pose holds the tool without force until a valid one comes, in every mode", "[step]") {
    const auto [mode, geometry] = GENERATE(from_range(kWays));
    const World world = balls();
    const Settings settings = settingsOf(mode, geometry);
    for (const Pose& bad : badPoses()) {
        CAPTURE(int(mode), int(geometry), bad.p.transpose(), bad.q.coeffs().transpose());
        TickState state(world);
        TickRecord before;
        for (int tick = 0; tick < 200; ++tick)
            before = step(world, settings, {at(0, std::max(18.0, 25 - 0.05 * tick), 0)}, state);
        REQUIRE(before.wrench_C.force.y() > 1);
        for (int again = 0; again < 3; ++again) {
            const TickRecord r = step(world, settings, {bad}, state, {.audit = true});
            requireFinite(r);
            REQUIRE(r.flags == kBadInput);
            REQUIRE(isZero(r.wrench_C));
            REQUIRE(isZero(r.wrench_o));
            REQUIRE(r.X_WT == before.X_WT);
            REQUIRE(r.X_WT_device == before.X_WT_device);
        }
        const TickRecord after = step(world, settings, {at(0, 18, 0)}, state);
        REQUIRE((after.flags & kBadInput) == 0);
        REQUIRE(after.wrench_C.force.y() == Approx(before.wrench_C.force.y()).margin(1e-3));
    }
}

TEST_CASE("step: a solver that no table has holds the tool without force until one is named that it has", "[step]") {
    const auto [mode, geometry] = GENERATE(from_range(kWays));
    const World world = balls();
    const Settings settings = settingsOf(mode, geometry);
    for (auto solver : {&Settings::solver, &Settings::shadow, &Settings::frictionSolver, &Settings::frictionShadow}) {
        Settings wrong = settings;
        wrong.shadow = "pqp";
        wrong.*solver = "simplex";
        TickState state(world);
        TickRecord before;
        for (int tick = 0; tick < 200; ++tick)
            before = step(world, settings, {at(0, std::max(18.0, 25 - 0.05 * tick), 0)}, state);
        REQUIRE(before.wrench_C.force.y() > 1);
        const TickRecord held = step(world, wrong, {at(0, 18, 0)}, state);
        CHECK(held.flags == kBadInput);
        CHECK(isZero(held.wrench_C));
        CHECK(held.X_WT == before.X_WT);
        CHECK(step(world, settings, {at(0, 18, 0)}, state).wrench_C.force.y() == Approx(before.wrench_C.force.y()));
    }
}

TEST_CASE("step: the tool goes to the end of the range and back", "[step]") {
    const World world = balls();
    const auto [mode, geometry] = GENERATE(from_range(kWays));
    if (mode == Mode::Penalty) return;  // its virtual coupling follows slowly
    const Settings settings = settingsOf(mode, geometry);
    TickState state(world);
    const Pose end = at(1e6, 1e6, -1e6);
    TickRecord r;
    for (int tick = 0; tick < 20; ++tick) requireFinite(r = step(world, settings, {end}, state));
    CHECK(r.flags == 0);
    CHECK((r.X_WT.p - end.p).norm() < 1e-9);
    CHECK(isZero(r.wrench_C));
    CHECK(step(world, settings, {at(kBeyond, 0, 0)}, state).flags == kBadInput);
    for (int tick = 0; tick < 20; ++tick) requireFinite(r = step(world, settings, {at(0, 25, 0)}, state));
    CHECK(r.flags == 0);
    CHECK((r.X_WT.p - Vec3(0, 25, 0)).norm() < 1e-9);
}

TEST_CASE("step: an invalid target pose of an obstacle holds everything", "[step]") {
    const World world = balls();
    const Settings settings = settingsOf(Mode::Default, GENERATE(Geometry::Spheres, Geometry::Mesh));
    TickState state(world);
    step(world, settings, {at(0, 25, 0)}, state);
    for (const Pose& bad : badPoses()) {
        const TickRecord r = step(world, settings, {at(0, 24, 0), state.nextMove(std::span(&bad, 1))}, state);
        REQUIRE(r.flags == kBadInput);
        REQUIRE(isZero(r.wrench_C));
        REQUIRE(r.X_WT.p == Vec3(0, 25, 0));
        REQUIRE(state.obstacles()[0] == Pose{});
        // The recorded input reproduces it.
        const TickInput recorded = recordedTick(state, r).input;
        REQUIRE(recorded.move.obstacle == 0);
        TickState again(world);
        REQUIRE(step(world, settings, recorded, again).flags == kBadInput);
    }
    const Pose good = at(0, -1, 0);
    CHECK((step(world, settings, {at(0, 24, 0), state.nextMove(std::span(&good, 1))}, state).flags & kBadInput) == 0);
    CHECK(state.obstacles()[0].p.y() < 0);
}

TEST_CASE("step: a state that begins with an invalid pose is held until it restarts", "[step]") {
    const Settings settings = settingsOf(Mode::Default, GENERATE(Geometry::Spheres, Geometry::Mesh));
    for (const Pose& bad : badPoses()) {
        World world = balls();
        TickState state(world);
        const auto held = [&](TickState& its) {
            const TickRecord r = step(world, settings, {at(0, 24, 0)}, its);
            requireFinite(r);
            return r.flags == kBadInput && isZero(r.wrench_C);
        };
        state.reset(bad);
        REQUIRE(held(state));
        state.begin({.X_WT = at(0, 25, 0), .X_WT_device = bad});
        REQUIRE(held(state));
        state.begin({.X_WT = at(0, 25, 0), .X_WT_device = at(0, 25, 0)}, std::span(&bad, 1));
        REQUIRE(held(state));
        REQUIRE(state.obstacles()[0] == Pose{});
        const Pose good;
        state.begin({.X_WT = at(0, 25, 0), .X_WT_device = at(0, 25, 0)}, std::span(&good, 1));
        REQUIRE_FALSE(held(state));

        world.obstacles[0].X_WO = bad;
        TickState misplaced(world);
        REQUIRE(held(misplaced));
        world.obstacles[0].X_WO = {};
        world.X_WT_start = bad;
        TickState astray(world);
        REQUIRE(held(astray));
        astray.reset(at(0, 25, 0));
        REQUIRE_FALSE(held(astray));
    }
}

TEST_CASE("step: arbitrary numbers as poses give finite records, and only valid poses give force", "[step]") {
    const unsigned seed = GENERATE(range(1u, 9u));
    const auto [mode, geometry] = GENERATE(from_range(kWays));
    CAPTURE(seed, int(mode), int(geometry));
    AnyNumber any(seed);
    const World world =
        test::withMeshes(test::worldOf(test::blob(70, 20, seed), test::blob(130, 20, seed + 50), at(0, 60, 0)),
                         test::blobMesh(20, 12, 7), test::blobMesh(20, 10, 6));
    const Settings settings = settingsOf(mode, geometry);
    TickState state(world);
    PenetrationMeter meter(world);
    for (int tick = 0; tick < 300; ++tick) {
        TickInput input{{any.vector(), any.quaternion()}};
        if (any.next() % 3) input.X_WT_device = {0.6 * Vec3(any.small(), any.small(), any.small()), any.rotation()};
        const Pose target{any.vector(), any.quaternion()};
        if (any.next() % 5 == 0) input.move = state.nextMove({&target, 1});
        const bool bad = !input.X_WT_device.isValid() || (input.move.obstacle >= 0 && !target.isValid());
        const TickRecord r = step(world, settings, input, state, {.audit = true});
        requireFinite(r);
        REQUIRE(((r.flags & kBadInput) != 0) == bad);
        if (bad) REQUIRE(isZero(r.wrench_C));
        const double depth = meter.depth(r.X_WT, state.obstacles(), geometry);
        REQUIRE(depth >= 0);
        REQUIRE(depth < 100);  // the bodies are not larger than this
    }
}

TEST_CASE("penetration meter: the depth is zero at an invalid pose", "[step]") {
    const World world = balls();
    PenetrationMeter meter(world);
    for (const Pose& bad : badPoses()) {
        if (bad.p.cwiseAbs().maxCoeff() < 100) continue;  // its rotation is invalid, but its position is near
        CHECK(meter.depth(bad) == 0);
        CHECK(meter.depth(at(0, 15, 0)) == Approx(5));  // the next call uses the other search
        CHECK(meter.depth(bad) == 0);
    }
}

TEST_CASE("tick driver: an invalid device pose is a counted fault, and engaging restores the force", "[loop][safety]") {
    for (const Pose& bad : badPoses())
        for (const int when : {0, 250}) {
            CAPTURE(when, bad.p.transpose(), bad.q.coeffs().transpose());
            Run run(std::make_unique<ScriptedDevice>([&](int call) {
                return DeviceReading{.X_WT_device = call == when ? bad : at(0, call == 0 ? 8 : 3, 0)};
            }));
            TickRecord before;
            if (when > 0) before = run.ticks(when);
            const TickRecord r = run.ticks(1);
            REQUIRE((r.flags & kBadInput) != 0);
            REQUIRE(isZero(r.wrench_C));
            REQUIRE(isZero(r.wrench_out));
            REQUIRE((r.trips & bit(Trip::BadInput)) != 0);
            REQUIRE(run.safety().count(Trip::BadInput).ticks == 1);
            REQUIRE(run.safety().engagement() == Engagement::Faulted);
            REQUIRE(run.safety().cause() == Trip::BadInput);
            if (when > 0) REQUIRE(r.X_WT == before.X_WT);
            REQUIRE(isZero(run.ticks(50).wrench_out));
            run.driver.engage();
            REQUIRE(run.ticks(250).wrench_out.force.y() == Approx(2).epsilon(0.01));
            REQUIRE(run.safety().count(Trip::BadInput).ticks == 1);
        }
}

TEST_CASE("devices: a motion through invalid poses is bad input meanwhile, played or followed by a hand", "[devices]") {
    const auto file = std::filesystem::temp_directory_path() / ("touchstone-far-" + std::to_string(getpid()) + ".csv");
    for (const double far : {1.1e6, -1e30, 1e150, -1e308}) {
        DeviceContext context;
        const std::vector<MotionKey> keys = motionThrough(at(0, far, 0));
        context.demonstration = std::make_shared<RecordedMotion>(keys);
        writeMotion(file, keys);
        for (const auto& [name, after] :
             {std::pair{"demo", std::string()}, {"replay", file.string()}, {"hand", std::string("0.1,500,14,2")}}) {
            CAPTURE(far, name);
            context.file = after;
            Run run(findDevice(name, handTable())->make(context));
            run.ticks(200);
            for (int t = 200; t <= 201; ++t) {
                const TickRecord r = run.ticks(1);
                CHECK((r.flags & kBadInput) != 0);
                CHECK(isZero(r.wrench_out));
            }
            run.ticks(1);
            CHECK((run.ticks(1).flags & kBadInput) == 0);
            CHECK(run.safety().count(Trip::BadInput).events == 1);
            run.driver.engage();
            const TickRecord last = run.ticks(300);
            CHECK(last.wrench_out.force.y() > 0.5);
            CHECK((last.X_WT.p - Vec3(0, 5, 0)).norm() < 0.1);
        }
    }
    std::filesystem::remove(file);
}

TEST_CASE("devices: a motion that begins with an invalid pose becomes valid later", "[devices]") {
    DeviceContext context;
    context.demonstration = std::make_shared<RecordedMotion>(
        std::vector<MotionKey>{{0, at(1e308, 0, 0)}, {1, at(0, 8, 0)}, {9, at(0, 8, 0)}});
    context.file = GENERATE("", "0.1,500,14,0");
    Run run(findDevice(context.file.empty() ? "demo" : "hand", handTable())->make(context));
    CHECK(run.ticks(1).flags == kBadInput);
    CHECK(run.ticks(1).flags == 0);
    CHECK((run.ticks(5).X_WT.p - Vec3(0, 8, 0)).norm() < 1e-9);
}

TEST_CASE("motion: poses between keys of the largest numbers are invalid, all other poses are kept", "[motion]") {
    const double most = std::numeric_limits<double>::max();
    const RecordedMotion motion({{0, at(0, 1, 0)}, {1, at(-most, 0, 0)}, {3, at(most, 0, 0)}, {4, at(0, 2, 0)}});
    CHECK(motion.at(0) == at(0, 1, 0));
    for (const double t : {1.0, 1.5, 2.0, 2.999}) CHECK_FALSE(motion.at(t).isValid());
    CHECK(motion.at(4) == at(0, 2, 0));
    const RecordedMotion forever({{-most, at(0, 1, 0)}, {most, at(0, 2, 0)}});
    CHECK(forever.at(most) == at(0, 2, 0));
    CHECK(forever.at(-most) == at(0, 1, 0));
    Run run(std::make_unique<MotionDevice>(std::make_shared<RecordedMotion>(forever)));
    run.ticks(3);
}

TEST_CASE("devices: a mouse that points beyond the horizon leaves the hand where it was", "[devices]") {
    const auto target = std::make_shared<MouseTarget>();
    MouseDevice mouse(target, at(0, 8, 0));
    mouse.read(0, 1);
    for (const Pose& bad : badPoses()) {
        target->grab(bad);
        CHECK(mouse.read(1, 1).X_WT_device == at(0, 8, 0));
    }
}

TEST_CASE("devices: a pose out of range before or after the workspace mapping is bad input until engaged", "[device]") {
    Pose hand;
    auto script = [&](int) { return DeviceReading{.X_WT_device = hand}; };
    const auto mapped = [&] {
        auto device = makeMapped(std::make_unique<ScriptedDevice>(script), at(0, 8, 0));
        Workspace workspace;
        workspace.scale = 100;
        device->control()->setWorkspace(workspace);
        return device;
    };
    for (const Pose& bad : badPoses()) {
        Run run(mapped());
        hand = {};
        run.ticks(10);
        hand = bad;
        const TickRecord r = run.ticks(1);
        REQUIRE((r.flags & kBadInput) != 0);
        REQUIRE(r.X_WT == at(0, 8, 0));
        hand = {};
        run.driver.engage();
        REQUIRE(run.ticks(1).flags == 0);
    }
    Run run(mapped());
    hand = {};
    run.ticks(10);
    hand.p.y() = 2e4;  // 2 km in the scene
    CHECK((run.ticks(1).flags & kBadInput) != 0);
    run.driver.engage();
    CHECK(run.ticks(1).flags == 0);
    CHECK(run.ticks(1).X_WT == at(0, 8, 0));
}

}  // namespace touchstone::bad_pose_tests
