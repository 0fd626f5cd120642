#include "haptics/loop/tick_driver.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <vector>

#include "tests/support/ground_world.hpp"
#include "tests/support/mesh_world.hpp"

namespace touchstone::tick_driver_tests {

namespace {

/// The tool touches when its node is at z = 5 mm, and 0.01 mm lower with its mesh, which the leaves cover.
std::shared_ptr<const World> groundWorld() {
    return std::make_shared<const World>(
        test::withMeshes(*test::groundBelow(Vec3::UnitZ(), 20), test::centeredBox(15, 9, 9.99),
                         test::moved(test::centeredBox(100, 100, 100), 1, {0, 0, 950})));
}

/// Everything that passed between driver and device.
struct Log {
    std::vector<double> times;
    std::vector<Wrench> written;
    std::vector<Pose> engaged;
    bool destroyed = false;
};

class ScriptedDevice final : public Device {
  public:
    using Script = std::function<DeviceReading(int call)>;
    static constexpr DeviceLimits kNone{.peakForce = 1000, .peakTorque = 10000, .motors = false};
    ScriptedDevice(Log& log, Script script, const DeviceLimits& limits = kNone)
        : log_(log), script_(std::move(script)), limits_(limits) {}
    ~ScriptedDevice() override { log_.destroyed = true; }
    DeviceReading read(double t, double) noexcept override {
        log_.times.push_back(t);
        return script_(static_cast<int>(log_.times.size()) - 1);
    }
    void write(const Wrench& wrench) noexcept override { log_.written.push_back(wrench); }
    void engage(const Pose& X_WT) noexcept override { log_.engaged.push_back(X_WT); }
    DeviceLimits limits() const noexcept override { return limits_; }

  private:
    Log& log_;
    Script script_;
    DeviceLimits limits_;
};

DeviceReading at(double z) { return {.X_WT_device = {{0, 0, z}, Quat::Identity()}}; }

/// One tick in free air, then 5 mm deep: the tool rests, and at 1 N/mm the force is 5 N except for the curved ground.
DeviceReading pressing(int call) { return call == 0 ? at(20) : at(0); }

struct Fixture {
    Log log;
    std::shared_ptr<const World> world = groundWorld();
    std::unique_ptr<TickDriver> driver;

    explicit Fixture(ScriptedDevice::Script script = pressing, const Settings& settings = {},
                     const DeviceLimits& limits = ScriptedDevice::kNone) {
        driver = std::make_unique<TickDriver>(session(log, std::move(script), settings, 0, limits));
    }
    std::unique_ptr<Session> session(Log& its, ScriptedDevice::Script script, const Settings& settings = {},
                                     std::uint64_t number = 0,
                                     const DeviceLimits& limits = ScriptedDevice::kNone) const {
        return std::make_unique<Session>(world, settings,
                                         std::make_unique<ScriptedDevice>(its, std::move(script), limits), number);
    }
    Engagement engagement() const { return driver->session().safety.engagement(); }
    TickRecord run(int ticks) {
        TickRecord record;
        for (int i = 0; i < ticks; ++i) record = driver->tick();
        return record;
    }
};

/// Share of the tick's force that reached the device.
double share(const TickRecord& record) { return record.wrench_out.force.z() / record.wrench_o.force.z(); }

// The tool rests while the force changes; only the QP's tolerance of 1e-10 mm on 5 mm moves it.
constexpr double kStill = 1e-8;

}  // namespace

TEST_CASE("ramp: a straight line from any value that arrives exactly", "[loop]") {
    Ramp ramp(1);
    CHECK(ramp.next() == 1);
    ramp.to(3, 4);
    for (const double expected : {1.5, 2.0, 2.5, 3.0, 3.0}) CHECK(ramp.next() == Approx(expected).epsilon(1e-15));
    CHECK(ramp.value() == 3);
    ramp.to(0, 3);
    CHECK(ramp.next() == Approx(2));
    ramp.to(5, 2);
    CHECK(ramp.next() == Approx(3.5));
    CHECK(ramp.next() == 5);
    ramp.to(1, 0);
    CHECK(ramp.next() == 1);
}

TEST_CASE("tick driver: the safety stage gets the wrench and the flags that must stop the force, and no other",
          "[loop]") {
    TickRecord record;
    record.wrench_o = {{1, 2, 3}, {4, 5, 6}};
    record.flags = ~std::uint32_t(kNonFinite | kBadInput | kListOverflow);
    SafetyInput input = safetyInput(record);
    CHECK(input.wrench_o.force == Vec3(1, 2, 3));
    CHECK(input.wrench_o.torque == Vec3(4, 5, 6));
    CHECK_FALSE((input.solverFailed || input.badInput || input.listOverflow));
    record.flags = kNonFinite;
    CHECK(safetyInput(record).solverFailed);
    record.flags = kBadInput;
    CHECK(safetyInput(record).badInput);
    record.flags = kListOverflow;
    CHECK(safetyInput(record).listOverflow);
}

TEST_CASE("tick driver: the force fades in over the first 100 ms, then passes unchanged", "[loop]") {
    Fixture f;
    f.run(1);
    for (int tick = 2; tick <= 150; ++tick) {
        const TickRecord record = f.run(1);
        REQUIRE(record.wrench_o.force.z() == Approx(5).epsilon(0.01));
        REQUIRE(share(record) == Approx(std::min(1.0, tick / 100.0)).epsilon(1e-12));
        REQUIRE(f.log.written.back().force == record.wrench_out.force);
    }
    CHECK(f.log.written.size() == 150);
}

TEST_CASE("tick driver: stiffness ramps over 200 ms and arrives exactly", "[loop]") {
    Fixture f;
    const double before = f.run(200).wrench_o.force.z();
    Settings settings;
    settings.stiffness = 2;
    settings.torsion = 500;
    f.driver->request(settings);
    double last = before;
    for (int tick = 1; tick <= 200; ++tick) {
        const TickRecord record = f.run(1);
        REQUIRE(record.wrench_o.force.z() == Approx(before * (1 + tick / 200.0)).epsilon(kStill));
        REQUIRE(share(record) == 1);  // no fade
        last = record.wrench_o.force.z();
        if (tick == 100) f.driver->request(settings);  // the same request does not restart the ramp
    }
    CHECK(f.run(1).wrench_o.force.z() == Approx(last).epsilon(kStill));
    // With a new target half way back, the ramp continues from there.
    settings.stiffness = 1;
    f.driver->request(settings);
    CHECK(f.run(100).wrench_o.force.z() == Approx(1.5 * before).epsilon(kStill));
    settings.stiffness = 2.5;
    f.driver->request(settings);
    CHECK(f.run(100).wrench_o.force.z() == Approx(2 * before).epsilon(kStill));
    CHECK(f.run(100).wrench_o.force.z() == Approx(2.5 * before).epsilon(kStill));
}

TEST_CASE("tick driver: solver and geometry change at zero force, 50 ms out and 100 ms in", "[loop]") {
    Fixture f;
    f.run(200);
    const Settings before = f.driver->settings();
    Settings settings = before;
    if (GENERATE(true, false))
        settings.solver = "active-set";
    else
        settings.geometry = before.geometry == Geometry::Mesh ? Geometry::Spheres : Geometry::Mesh;
    settings.stiffness = 3;
    f.driver->request(settings);
    for (int tick = 1; tick <= 50; ++tick) {
        const TickRecord record = f.run(1);
        REQUIRE(share(record) == Approx(1 - tick / 50.0).margin(1e-12));
        REQUIRE(f.driver->settings() == before);
        REQUIRE(record.wrench_o.force.z() == Approx(5).epsilon(0.01));  // with the old stiffness too
    }
    for (int tick = 1; tick <= 120; ++tick) {
        const TickRecord record = f.run(1);
        REQUIRE(f.driver->settings() == settings);
        REQUIRE(record.X_WT.p.z() == Approx(5).margin(0.01));  // it stays where it was, up to the kept distance
        REQUIRE(f.driver->fade() == Approx(std::min(1.0, tick / 100.0)).epsilon(1e-12));
    }
}

TEST_CASE("tick driver: the newest of several requests during a fade wins, and no fade restarts", "[loop]") {
    Fixture f;
    f.run(200);
    Settings settings;
    settings.mode = Mode::Paper;
    f.driver->request(settings);
    f.run(25);
    settings.mode = Mode::Default;
    settings.pause = true;
    f.driver->request(settings);
    f.run(25);
    CHECK(f.driver->fade() == 0);
    const TickRecord record = f.run(1);
    CHECK(f.driver->settings().mode == Mode::Default);
    CHECK((record.flags & kPaused));
}

TEST_CASE("tick driver: a change that cannot make the force jump acts at the next tick", "[loop]") {
    Fixture f;
    f.run(200);
    Settings settings;
    settings.margin = 0.7;
    settings.shadow = kNoSolver;
    f.driver->request(settings);
    CHECK(share(f.run(1)) == 1);
    CHECK(f.driver->settings().margin == 0.7);
}

TEST_CASE("tick driver: without force a change acts at once, without a fade", "[loop]") {
    Fixture f([](int) { return at(20); });
    f.run(200);
    Settings settings;
    settings.mode = Mode::Paper;
    f.driver->request(settings);
    f.run(1);
    CHECK(f.driver->settings().mode == Mode::Paper);
}

TEST_CASE("tick driver: a new rate changes the tick count of fades and keeps the device time", "[loop]") {
    Fixture f;
    f.run(200);
    Settings settings;
    settings.rate = 2000;
    f.driver->request(settings);
    f.run(50);
    CHECK(f.log.times.back() == 249);
    CHECK(f.driver->fade() == 0);
    f.run(100);
    CHECK(f.driver->fade() == Approx(0.5));
    f.run(100);
    CHECK(f.driver->fade() == 1);
    for (std::size_t i = 250; i < f.log.times.size(); ++i)
        REQUIRE(f.log.times[i] == 250 + 0.5 * static_cast<double>(i - 250));
    // The same for ramps: 200 ms are 400 ticks.
    settings.stiffness = 2;
    f.driver->request(settings);
    const double before = f.run(1).wrench_o.force.z();
    CHECK(f.run(399).wrench_o.force.z() == Approx(2 * before / (1 + 1 / 400.0)).epsilon(kStill));
}

TEST_CASE("tick driver: tick n reads the device at n / rate", "[loop]") {
    Settings settings;
    settings.rate = 3000;
    Fixture f(pressing, settings);
    f.run(1000);
    for (int n = 0; n < 1000; ++n) REQUIRE(f.log.times[n] == n * 1000.0 / 3000);
}

TEST_CASE("tick driver: pause holds the tool with zero force, and resuming fades in", "[loop]") {
    Fixture f([](int call) { return call == 0 ? at(20) : at(call < 300 ? 0 : -2); });
    const TickRecord loaded = f.run(200);
    Settings settings;
    settings.pause = true;
    f.driver->request(settings);
    f.run(50);
    for (int i = 0; i < 150; ++i) {
        const TickRecord record = f.run(1);
        REQUIRE((record.flags & kPaused));
        REQUIRE(record.wrench_out.force == Vec3::Zero());
        REQUIRE((record.X_WT.p - loaded.X_WT.p).norm() < kStill);
    }
    settings.pause = false;
    f.driver->request(settings);
    const TickRecord resumed = f.run(1);
    CHECK(resumed.wrench_o.force.z() > 6);
    CHECK(share(resumed) == Approx(0.01).epsilon(1e-9));
}

TEST_CASE("tick driver: a new session starts at zero force and at its own start pose", "[loop]") {
    Log second;
    Fixture f;
    f.run(200);
    Settings settings;
    settings.rate = 500;
    settings.stiffness = 2;
    f.driver->open(f.session(second, pressing, settings, 7));
    CHECK(f.driver->opening());
    CHECK(f.driver->newestSession() == 7);
    f.run(50);
    CHECK(f.driver->takeRetired() == nullptr);
    CHECK(f.log.written.back().force == Vec3::Zero());
    CHECK(second.times.empty());

    settings.stiffness = 3;
    f.driver->request(settings);  // for the coming session
    const TickRecord first = f.run(1);
    CHECK_FALSE(f.driver->opening());
    CHECK(f.driver->session().number == 7);
    CHECK(first.tick == 0);
    CHECK(second.times == std::vector<double>{0});
    const TickRecord pressed = f.run(1);
    CHECK(pressed.wrench_o.force.z() ==
          Approx(15).epsilon(0.01));            // no ramp: the session begins with its own stiffness
    CHECK(share(pressed) == Approx(2 / 50.0));  // 100 ms at 500 Hz
    CHECK_FALSE(f.log.destroyed);
    CHECK(f.driver->takeRetired() != nullptr);
    CHECK(f.log.destroyed);
    CHECK(f.log.written.size() == 250);
}

TEST_CASE("tick driver: a stale reading holds the tool with zero force, which then fades in", "[loop]") {
    Fixture f([](int call) {
        DeviceReading reading = pressing(call);
        if (call >= 200 && call < 203) reading = {.X_WT_device = {{0, 0, -300}, Quat::Identity()}, .valid = false};
        return reading;
    });
    const TickRecord before = f.run(200);
    for (int i = 0; i < 3; ++i) {
        const TickRecord stale = f.run(1);
        CHECK(stale.wrench_out.force == Vec3::Zero());
        CHECK((stale.X_WT.p - before.X_WT.p).norm() == 0);
        CHECK((stale.X_WT_device.p - before.X_WT_device.p).norm() == 0);
    }
    CHECK(f.driver->session().safety.count(Trip::StaleReading).ticks == 3);
    CHECK(f.driver->session().safety.count(Trip::StaleReading).events == 1);
    CHECK(share(f.run(1)) == Approx(0.01));
    CHECK(share(f.run(99)) == 1);
}

TEST_CASE("tick driver: a pose that is not finite gives a finite record and zero force", "[loop]") {
    for (const int broken : {0, 200}) {
        Fixture f([broken](int call) {
            DeviceReading reading = pressing(call);
            if (call == broken) reading.X_WT_device.p.x() = std::nan("");
            return reading;
        });
        f.run(broken);
        const TickRecord record = f.run(1);
        CHECK((record.flags & kBadInput));
        CHECK(record.wrench_out.force == Vec3::Zero());
        CHECK(record.X_WT.isFinite());
        CHECK(record.X_WT_device.isFinite());
        CHECK(f.driver->session().safety.count(Trip::BadInput).ticks == 1);
        CHECK(f.run(150).wrench_out.isFinite());
    }
}

TEST_CASE("tick driver: a failure during a fade-out makes the change act at once", "[loop]") {
    Fixture f([](int call) {
        DeviceReading reading = pressing(call);
        reading.valid = call != 210;
        return reading;
    });
    f.run(200);
    Settings settings;
    settings.solver = "active-set";
    f.driver->request(settings);
    f.run(11);
    CHECK(f.driver->settings().solver == kExactSolver);
    f.run(1);
    CHECK(f.driver->settings().solver == settings.solver);
}

TEST_CASE("tick driver: a restart resets device time and tool", "[loop]") {
    Fixture f([](int call) { return at(call == 0 || call == 250 ? 20 : 0); });
    f.run(200);
    f.driver->restart();
    f.run(50);
    CHECK(f.log.times.back() == 249);
    const TickRecord record = f.run(1);
    CHECK(f.log.times.back() == 0);
    CHECK(record.tick == 0);
    CHECK(record.X_WT.p.z() == Approx(20).epsilon(1e-15));
    CHECK(record.wrench_o.force == Vec3::Zero());
    CHECK(f.driver->fade() == Approx(0.01));
}

TEST_CASE("tick driver: the tool begins at the device's first pose", "[loop]") {
    Fixture f([](int) { return at(12); });
    const TickRecord record = f.run(1);
    CHECK(record.X_WT.p.z() == Approx(12).epsilon(1e-15));
    CHECK(record.wrench_o.force == Vec3::Zero());
}

TEST_CASE("tick driver: the same requests give the same ticks, with clocks or without", "[loop]") {
    const auto hashOf = [](const TickClocks& clocks) {
        Fixture f([](int call) { return at(call == 0 ? 20 : 2 * std::cos(0.01 * call)); });
        std::uint64_t hash = 0;
        for (int i = 0; i < 600; ++i) {
            Settings settings;
            if (i == 100) settings.stiffness = 2;
            if (i == 250) settings.mode = Mode::Paper;
            if (i == 100 || i == 250 || i == 400) f.driver->request(settings);
            if (i == 500) f.driver->restart();
            hash = hashTick(f.driver->tick(clocks), hash);
        }
        return hash;
    };
    const TickClocks clocks{.stage = {.now = [] { return std::uint64_t{7}; }, .microseconds = 1},
                            .cpuMicroseconds = [] { return 3.0; }};
    CHECK(hashOf({}) == hashOf({}));
    CHECK(hashOf({}) == hashOf(clocks));
}

TEST_CASE("tick driver: a device with motors waits to be engaged, and is then mapped to the tool", "[loop][safety]") {
    Fixture f(pressing, {}, {});
    for (int i = 0; i < 50; ++i) {
        const TickRecord record = f.run(1);
        REQUIRE(record.wrench_out.force == Vec3::Zero());
        REQUIRE(record.X_WT.p == f.world->X_WT_start.p);  // the tool is held, at any pose of the device
    }
    CHECK(f.engagement() == Engagement::Stopped);
    f.driver->engage();
    REQUIRE(f.log.engaged.size() == 1);
    CHECK(f.log.engaged[0].p == f.world->X_WT_start.p);
    CHECK(f.engagement() == Engagement::Engaging);
    f.run(1);
    f.driver->engage();  // it is already engaged
    CHECK(f.log.engaged.size() == 1);
}

namespace {

/// A device with motors that obeys engage(); the test then lowers it. The ground is at z = 5.
struct MappedFixture {
    double depth = 0;
    bool broken = false, fault = false;
    std::uint32_t buttons = 0;
    Fixture f;

    explicit MappedFixture(const Settings& settings = {}, const DeviceLimits& limits = {})
        : f(
              [this](int) {
                  DeviceReading reading = at(f.log.engaged.empty() ? 80 : f.log.engaged.back().p.z() - depth);
                  if (broken) reading.X_WT_device.p.x() = std::nan("");
                  reading.fault = fault;
                  reading.buttons = buttons;
                  return reading;
              },
              settings, limits) {}
    /// Lowers it to 2 mm below the ground, which takes 2 N.
    void press() {
        const double to = f.log.engaged.back().p.z() - 3;
        for (int i = 1; i <= 50; ++i) {
            depth = i * to / 50;
            f.run(1);
        }
        CHECK(f.run(100).wrench_out.force.z() == Approx(2).epsilon(0.01));
        CHECK(f.engagement() == Engagement::Engaged);
    }
};

}  // namespace

TEST_CASE("tick driver: a stop holds the tool at zero force until the device is mapped to it again", "[loop][safety]") {
    Log second;  // outlives the driver
    MappedFixture m;
    Fixture& f = m.f;
    f.run(10);
    f.driver->engage();
    m.press();
    f.driver->stop();
    const Vec3 held = f.driver->tick().X_WT.p;
    for (int i = 0; i < 50; ++i) {
        m.depth -= 0.5;
        const TickRecord record = f.run(1);
        REQUIRE(record.wrench_out.force == Vec3::Zero());
        REQUIRE((record.X_WT.p - held).norm() < kStill);
        REQUIRE(record.X_WT_device.p.z() > record.X_WT.p.z() - 3);  // the device pose is still recorded
    }
    m.depth = 0;
    f.driver->engage();
    CHECK((f.log.engaged.back().p - held).norm() < kStill);
    CHECK(f.run(1).wrench_out.force.norm() < 1e-6);  // no jump
    m.press();

    // A restart also stops, and so does another scene.
    f.driver->restart();
    f.run(60);
    CHECK(f.engagement() == Engagement::Stopped);
    CHECK(f.run(1).X_WT.p == f.world->X_WT_start.p);
    m.depth = 0;
    f.driver->engage();
    m.press();
    f.driver->open(f.session(second, pressing, {}, 1, DeviceLimits{}));
    f.run(100);
    CHECK(f.engagement() == Engagement::Stopped);
    for (const Wrench& wrench : second.written) REQUIRE(wrench.force == Vec3::Zero());
}

TEST_CASE("tick driver: after a fault the tool continues, and engaging restores the force", "[loop][safety]") {
    MappedFixture m;
    Fixture& f = m.f;
    f.driver->engage();
    m.press();
    m.broken = true;
    CHECK(f.run(1).trips == bit(Trip::BadInput));
    m.broken = false;
    CHECK(f.engagement() == Engagement::Faulted);
    m.fault = true;
    CHECK(f.run(1).trips == bit(Trip::DeviceFault));
    m.fault = false;
    for (int i = 0; i < 300; ++i) REQUIRE(f.run(1).wrench_out.force == Vec3::Zero());
    m.depth -= 10;
    CHECK(f.run(30).X_WT.p.z() > 8);
    m.depth = 0;
    f.driver->engage();
    CHECK(f.run(1).wrench_out.force.norm() < 1e-6);
    m.press();
}

TEST_CASE("tick driver: without the dead-man button there is no force, and pressing it engages", "[loop][safety]") {
    Settings settings;
    settings.deadMan = 2;
    MappedFixture m(settings);
    Fixture& f = m.f;
    f.run(10);
    m.buttons = 1;  // another button
    f.run(10);
    CHECK(f.engagement() == Engagement::Stopped);
    m.buttons = 2;
    CHECK(f.run(1).X_WT.p == f.world->X_WT_start.p);
    CHECK(f.log.engaged.size() == 1);
    CHECK((f.run(1).X_WT.p - f.world->X_WT_start.p).norm() < kStill);  // never at the earlier device pose
    m.press();
    m.buttons = 5;
    CHECK(f.run(1).wrench_out.force == Vec3::Zero());  // in the same tick
    CHECK(f.engagement() == Engagement::Stopped);
    f.driver->engage();
    CHECK(f.run(2).wrench_out.force == Vec3::Zero());
    m.depth = 0;
    m.buttons = 2;
    f.run(1);
    m.press();
}

TEST_CASE("tick driver: a dead-man button that is held from the start engages nothing", "[loop][safety]") {
    Settings settings;
    settings.deadMan = 2;
    MappedFixture m(settings);
    m.buttons = 2;
    m.f.run(50);
    CHECK(m.f.engagement() == Engagement::Stopped);
    settings.deadMan = 0;  // nor does it when the setting no longer names a button
    m.buttons = 0;
    m.f.run(1);
    m.f.driver->request(settings);
    m.f.run(50);
    CHECK(m.f.engagement() == Engagement::Stopped);
}

TEST_CASE("tick driver: the force is zero in a late tick and then fades in", "[loop][safety]") {
    MappedFixture m;
    Fixture& f = m.f;
    f.driver->engage();
    m.press();
    CHECK(f.driver->tick({.stage = {}, .periodMs = 9.9}).wrench_out.force.z() > 1.9);
    const TickRecord late = f.driver->tick({.stage = {}, .periodMs = 10.1});
    CHECK(late.periodUs == Approx(10'100));
    CHECK(late.trips == bit(Trip::LateTick));
    CHECK(late.wrench_out.force == Vec3::Zero());
    CHECK(share(f.run(1)) == Approx(0.01));
    CHECK(share(f.run(99)) == 1);
}

TEST_CASE("tick driver: the slew-rate limit is per ms, at any rate", "[loop][safety]") {
    for (const double rate : {500.0, 1000.0, 4000.0}) {
        Settings settings;
        settings.rate = rate;
        MappedFixture m(settings);
        Fixture& f = m.f;
        f.driver->engage();
        f.run(static_cast<int>(rate));
        m.depth = 30;  // 15 N in one tick
        double before = 0, steepest = 0;
        for (int i = 0; i < 100; ++i) {
            const double now = f.run(1).wrench_out.force.z();
            steepest = std::max(steepest, now - before);
            before = now;
        }
        CHECK(before > 14);
        CHECK(steepest == Approx(3 * 1000 / rate));
    }
}

TEST_CASE("tick driver: another scene does not cool the motors", "[loop][safety]") {
    const DeviceLimits weak{.continuousForce = 0.02};
    Log second;  // outlives the driver, as does z
    double z = 8;
    MappedFixture m({}, weak);
    Fixture& f = m.f;
    f.driver->engage();
    f.run(1);
    m.depth = 17;
    f.run(300);
    CHECK(f.driver->session().safety.active(Trip::ForceThermallyLimited));
    f.driver->open(f.session(
        second, [&](int) { return at(z); }, {}, 1, weak));
    f.run(60);
    f.driver->engage();
    f.run(2);
    CHECK_FALSE(f.driver->session().safety.active(Trip::ForceThermallyLimited));
    z = 3;
    f.run(1);
    CHECK(f.driver->session().safety.active(Trip::ForceThermallyLimited));
}

TEST_CASE("tick driver: its destructor leaves the device with zero force", "[loop]") {
    Fixture f;
    f.run(200);
    CHECK(f.log.written.back().force.z() > 4);
    f.driver.reset();
    CHECK(f.log.written.back().force == Vec3::Zero());
    CHECK(f.log.destroyed);
}

}  // namespace touchstone::tick_driver_tests
