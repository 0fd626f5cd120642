// The loop with the fake device: the device's scheduler drives the ticks, or the loop does.
#include "haptics/hands/motion.hpp"
#include "haptics/loop/haptic_loop.hpp"
#include "tests/support/fake_hd/fake_hd_device.hpp"
#include "tests/support/ground_world.hpp"

namespace touchstone::phantom_loop_tests {

using namespace touchstone::test;

namespace {

LoopOptions unraised() {
    LoopOptions options;
    options.realTime.raise = false;
    options.watchdogMs = 0;
    return options;
}

/// Begins 1 mm above the ground, where the hand takes the tool.
struct Touching {
    FakeHd fake;
    std::shared_ptr<const World> world = groundBelow();
    std::shared_ptr<DeviceControl> control;
    std::unique_ptr<HapticLoop> loop;

    explicit Touching(const std::string& options, const std::string& faults = {}) : fake(faults) {
        // A busy machine may delay a thread for long; a stale reading maps the hand to the tool again, which then moves
        // less.
        auto device = openPhantom(options + ",stale=500", world->X_WT_start);
        control = device->control();
        loop = std::make_unique<HapticLoop>(world, Settings{}, std::move(device), unraised());
        // The hand rests until it holds the tool.
        REQUIRE(until([&](const LoopSnapshot& s) { return s.ticks > 5 && !stale(s) && engaged(s); }));
    }
    static bool stale(const LoopSnapshot& s) { return s.record.trips & bit(Trip::StaleReading); }
    bool engaged(const LoopSnapshot& s) {
        if (!isEngaged(s.engagement)) loop->engage();
        return isEngaged(s.engagement);
    }
    bool until(const std::function<bool(const LoopSnapshot&)>& done) {
        return within([&] { return loop->poll() && done(loop->snapshot()); });
    }
    /// The hand presses until it feels the ground: 13 mm down is 10 mm deep, where springs of 0.5 and 1 N/mm balance.
    bool press() {
        fake.hand(0, -13, 0, 0, 0, 0);
        return until([&](const LoopSnapshot& s) {
            return engaged(s) && std::abs(fake.force().y() - 10.0 / 3) < 0.1 &&
                   std::abs(fake.position().y() + 19.0 / 3) < 0.2;
        });
    }
};

}  // namespace

TEST_CASE("phantom loop: the hand feels the ground, whichever side drives the ticks", "[device]") {
    const std::string drive = GENERATE(",drive=loop", ",drive=device");
    INFO(drive);
    Touching touching(drive);
    REQUIRE(touching.press());
    touching.control.reset();
    touching.loop.reset();
    CHECK(touching.fake.force().isZero());
    CHECK(touching.fake.state().handles == 0);
    CHECK(touching.fake.state().misuses == 0);
}

TEST_CASE("phantom loop: drive=device ticks in callbacks, drive=loop in the loop's thread", "[device]") {
    const bool driven = GENERATE(false, true);
    Touching touching(driven ? ",drive=device" : ",drive=loop",
                      "lazy");  // the fake's 400 Hz; the loop would tick at 1000 Hz
    const std::uint64_t callbacks = touching.fake.state().ticks, ticks = touching.loop->snapshot().ticks;
    REQUIRE(touching.until([&](const LoopSnapshot& s) { return s.ticks > ticks + 500; }));
    const auto made = static_cast<double>(touching.fake.state().ticks - callbacks);
    const auto ticked = static_cast<double>(touching.loop->snapshot().ticks - ticks);
    if (driven)
        CHECK(made == Approx(ticked).epsilon(0.15));  // some ticks pass between the two queries
    else
        CHECK(made < 0.7 * ticked);
}

TEST_CASE("phantom loop: the loop ticks without force while the device's scheduler stops, then returns", "[device]") {
    Touching touching(",drive=device");
    REQUIRE(touching.press());
    touching.fake.fault("dead");
    std::uint64_t from = 0;
    REQUIRE(touching.until([&](const LoopSnapshot& s) {
        if (!Touching::stale(s)) return false;
        if (from == 0) from = s.ticks;
        return s.ticks > from + 100;
    }));
    CHECK(touching.loop->snapshot().record.wrench_out.force.isZero());
    touching.fake.fault("");
    // After engaging again the tool rests on the ground at the hand; 13 mm further down two springs balance again.
    REQUIRE(touching.until([&](const LoopSnapshot& s) { return !Touching::stale(s) && touching.engaged(s); }));
    touching.fake.hand(0, -26, 0, 0, 0, 0);
    CHECK(touching.until([&](const LoopSnapshot&) { return std::abs(touching.fake.force().y() - 13.0 / 3) < 0.1; }));
}

TEST_CASE("phantom loop: the scene continues without a lost device, and another session replaces it", "[device]") {
    const std::string drive = GENERATE(",drive=loop", ",drive=device");
    INFO(drive);
    Touching touching(drive);
    REQUIRE(touching.press());
    touching.fake.fault("comm");
    REQUIRE(touching.until([&](const LoopSnapshot&) { return touching.fake.force().isZero(); }));
    const std::uint64_t ticks = touching.loop->snapshot().ticks;
    REQUIRE(touching.until([&](const LoopSnapshot& s) { return s.ticks > ticks + 100; }));
    touching.control.reset();
    const auto still = std::make_shared<RecordedMotion>(std::vector<MotionKey>{{0, touching.world->X_WT_start}});
    touching.loop->open(touching.world, {}, std::make_unique<MotionDevice>(still));
    CHECK(touching.until([&](const LoopSnapshot& s) { return s.session == 1; }));
    CHECK(touching.until([&](const LoopSnapshot&) { return touching.fake.state().handles == 0; }));
}

TEST_CASE("phantom loop: a reconnected device continues where the tool is", "[device]") {
    const std::string drive = GENERATE(",drive=loop", ",drive=device");
    INFO(drive);
    Touching touching(drive);
    touching.fake.hand(30, 0, 0, 0, 0, 0);
    REQUIRE(touching.until([](const LoopSnapshot& s) { return s.record.X_WT.p.x() > 29.9; }));
    touching.fake.fault("comm");
    const auto is = [&](DeviceStatus::State state) { return touching.control->status().state == state; };
    REQUIRE(touching.until([&](const LoopSnapshot&) { return is(DeviceStatus::State::Lost); }));
    touching.control->reconnect();  // the stylus of the fake is at its origin again
    REQUIRE(touching.until([&](const LoopSnapshot& s) {
        return is(DeviceStatus::State::Running) && !Touching::stale(s) && touching.engaged(s);
    }));
    touching.fake.hand(5, 0, 0, 0, 0, 0);
    CHECK(touching.until([](const LoopSnapshot& s) { return s.record.X_WT.p.x() > 34; }));
}

TEST_CASE("phantom loop: rapid changes of scene and rate, and restarts, while the device drives", "[device]") {
    Touching touching(",drive=device");
    for (int round = 0; round < 30; ++round) {
        Settings settings;
        settings.rate = round % 3 == 0 ? 2000 : 1000;  // at 2000 Hz the loop drives
        settings.stiffness = 1 + 0.1 * round;
        if (round % 2)
            touching.loop->open(touching.world, settings,
                                openPhantom(",drive=device,stale=500", touching.world->X_WT_start));
        else
            touching.loop->setSettings(settings);
        if (round % 5 == 0) touching.loop->restart();
        const std::uint64_t ticks = touching.loop->snapshot().ticks;
        REQUIRE(touching.until([&](const LoopSnapshot& s) { return s.ticks > ticks + 10; }));
    }
    touching.control.reset();
    touching.loop.reset();
    CHECK(touching.fake.state().handles == 0);
    CHECK(touching.fake.state().misuses == 0);
}

}  // namespace touchstone::phantom_loop_tests
