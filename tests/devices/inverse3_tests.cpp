// Tests the driver against a fake of Haply's service, in normal operation and for each fault.
#include "haptics/sandbox/devices/inverse3.hpp"

#include "haptics/device/device_table.hpp"
#include "haptics/hands/hand_table.hpp"
#include "haptics/sandbox/devices/all_devices.hpp"
#include "haptics/sandbox/devices/inverse_link.hpp"
#include "tests/support/arm_matrix.hpp"
#include "tests/support/fake_inverse/fake_inverse.hpp"

namespace touchstone::inverse3_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;
using Catch::Contains;
using State = DeviceStatus::State;

namespace {

constexpr const char* kStale = "stale=500";  // a busy machine delays threads

std::unique_ptr<Device> openInverse(const std::string& options, const Pose& X_WT_start = {}) {
    DeviceContext context;
    context.X_WT_start = X_WT_start;
    context.file = options;
    return makeInverse3(context);
}

std::string refusal(const std::string& options) {
    try {
        openInverse(options);
    } catch (const std::runtime_error& e) {
        return e.what();
    }
    return {};
}

/// The Inverse3 as the safety matrix sees it. Faults "event NAME LEVEL TYPE" are events.
class InverseStandIn final : public ArmStandIn {
  public:
    explicit InverseStandIn(const std::string& faults = {}) : fake(faults) {}
    std::unique_ptr<Device> open(const std::string& options = {}) override {
        return openInverse(fake.options() + (options.empty() ? "" : ",") + options);
    }
    Vec3 force() const override { return fake.state().force; }
    Vec3 torque() const override { return {0, 0, 0}; }
    bool hasTorque() const override { return false; }
    void hand(const Vec3& p) override { fake.hand(p); }
    Vec3 position() const override { return fake.state().position; }
    void inject(const std::string& fault) override {
        if (fault.rfind("event ", 0) != 0) return fake.fault(fault);
        const std::size_t level = fault.find(' ', 6) + 1, type = fault.find(' ', level) + 1;
        fake.event(fault.substr(6, level - 7), fault.substr(level, type ? type - level - 1 : std::string::npos),
                   type ? fault.substr(type) : "");
    }
    void clear() override { fake.fault(""); }

    FakeInverse fake;
};

}  // namespace

// -- Messages ------------------------------------------------------------------------------------------------------

TEST_CASE("inverse3: Haply's axes are turned to those of a scene, forces back", "[device]") {
    CHECK(fromHaply(Vec3(1, 0, 0)) == Vec3(1, 0, 0));   // right
    CHECK(fromHaply(Vec3(0, 1, 0)) == Vec3(0, 0, -1));  // forward is away from the user
    CHECK(fromHaply(Vec3(0, 0, 1)) == Vec3(0, 1, 0));   // up
    CHECK(fromHaply(Vec3(0, 0, 1).cross(Vec3(1, 0, 0))) == fromHaply(Vec3(0, 0, 1)).cross(fromHaply(Vec3(1, 0, 0))));
    const Vec3 v(1, -2, 3), turn(0.3, -0.2, 0.5);
    CHECK(toHaply(fromHaply(v)) == v);
    // A turned vector is the same, whichever frame it is turned in.
    CHECK((fromHaply(expRotation(turn)) * fromHaply(v) - fromHaply(Vec3(expRotation(turn) * v))).norm() < 1e-12);
}

TEST_CASE("inverse3: the message of a force", "[device]") {
    CHECK(ForceMessage("049D", true).text({1, 2, -0.5}) ==
          R"({"inverse3":[{"device_id":"049D","commands":{"set_cursor_force":{"vector":{"x":1,"y":0.5,"z":2}}}}]})");
    CHECK(ForceMessage("a\"b", false).text(Vec3::Zero()) ==
          R"({"inverse3":[{"device_id":"a\"b","commands":{"set_cursor_force":{"values":{"x":0,"y":0,"z":0}}}}]})");
}

TEST_CASE("inverse3: an inventory is read, and the first usable grip of any kind is taken", "[device]") {
    const std::string arm =
        R"("inverse3": [{"device_id": "A", "state": {"cursor_position": {"x": 0.01, "y": 0.02, "z": 0.03}}},
                               {"device_id": "B", "state": {"cursor_position": {"x": 1, "y": 2, "z": 3}}}])";
    const std::string asleep =
        R"({"device_id": "S", "status": {"awake": false}, "state": {"orientation": {"w": 1, "x": 0, "y": 0, "z": 0}}})";
    const std::string wired =
        R"({"device_id": "W", "state": {"button": true, "orientation": {"w": 1, "x": 0, "y": 0, "z": 0}}})";
    const std::string custom = R"({"device_id": "C", "state": {"buttons": {"a": false, "b": true, "c": true},
                                   "orientation": {"w": 0.6, "x": 0.8, "y": 0, "z": 0}}})";
    const std::string grips = R"("verse_grip": [)" + wired + R"(], "wireless_verse_grip": [)" + asleep +
                              R"(], "custom_verse_grip": [)" + custom + "]";
    const InverseInventory inventory = readInventory("{" + arm + "," + grips + "}", "", "");
    CHECK(inventory.device == "A");
    CHECK_FALSE(inventory.vectorCommand);  // no session: a service 3.1
    CHECK((inventory.state.p_DS - Vec3(10, 30, -20)).norm() < 1e-12);
    REQUIRE(inventory.state.grip);
    CHECK(inventory.state.grip->id == "W");
    CHECK(inventory.state.grip->buttons == 1);
    const InverseInventory other = readInventory("{" + arm + "," + grips + R"(, "session_id": 3})", "B", "C");
    CHECK(other.device == "B");
    CHECK(other.vectorCommand);
    REQUIRE(other.state.grip);
    CHECK(other.state.grip->buttons == 6);
    CHECK_FALSE(readInventory("{" + arm + "," + grips + "}", "", "S").state.grip);
    CHECK_THROWS_WITH(readInventory("{" + arm + "}", "Z", ""), Contains("no Inverse3 'Z'"));
    for (const char* wrong : {"", "[]", "{}", "null", R"({"inverse3": 3})", R"({"inverse3": {"a": 1}})"})
        CHECK_THROWS_WITH(readInventory(wrong, "", ""), Contains("no inventory of devices") && Contains("port=PORT"));
}

TEST_CASE("inverse3: any text is a fault or a state, never an exception", "[device]") {
    const std::string good = R"({"inverse3": [{"device_id": "A", "status": {"ready": true},
        "state": {"cursor_position": {"x": 0.01, "y": 0.02, "z": 0.03}}}], "verse_grip": [{"device_id": "V",
        "state": {"buttons": {"a": true}, "orientation": {"w": 1, "x": 0, "y": 0, "z": 0}}}]})";
    InverseState state;
    REQUIRE(readState(good, "A", "", state) == InverseFault::None);
    for (std::size_t i = 0; i < good.size(); ++i) {
        readState(good.substr(0, i), "A", "", state);
        for (const char* wrong : {"[", "}", "null", "-", "9e999", "\xff", "\""}) {
            std::string text = good;
            text.replace(i, 1, wrong);
            if (readState(text, "A", "", state) == InverseFault::None) CHECK(state.p_DS.allFinite());
            readEvent(text, "A");
        }
    }
    CHECK(readState(std::string(100'000, '['), "A", "", state) == InverseFault::NotJson);
    CHECK(readState(std::string(50'000, '[') + std::string(50'000, ']'), "A", "", state) == InverseFault::NotJson);
}

TEST_CASE("inverse3: unknown options are refused by name", "[device]") {
    CHECK_THAT(refusal("spring=3"), Contains("'spring=3' is not an option") && Contains("port=PORT"));
    CHECK_THAT(refusal("port=70000"), Contains("'port=70000'"));
    CHECK_THAT(refusal("port=7.5"), Contains("'port=7.5'"));
    CHECK_THAT(refusal("force=torque"), Contains("'force=torque'"));
    const InverseOptions options =
        inverseOptions("port=7,events=8,device=A,grip=B,force=values,rate=500,stale=8,peak=3");
    CHECK(options.port == 7);
    CHECK(options.eventsPort == 8);
    CHECK(options.device == "A");
    CHECK(options.grip == "B");
    CHECK(options.command == "values");
    CHECK(options.rate == 500);
    CHECK(options.staleMs == 8);
    CHECK(options.peakForce == 3);
    setenv("TOUCHSTONE_INVERSE", "1234", 1);
    CHECK(inverseOptions("").port == 1234);
    CHECK(inverseOptions("port=9").port == 9);
    setenv("TOUCHSTONE_INVERSE", "here", 1);
    CHECK_THAT(refusal(""), Contains("TOUCHSTONE_INVERSE is 'here'"));
    unsetenv("TOUCHSTONE_INVERSE");
}

TEST_CASE("inverse3: the program's table has the core's devices and this one, by name", "[device]") {
    const auto all = allDevices();
    CHECK(all.size() == deviceTable().size() + handTable().size() + 1);
    CHECK(std::is_sorted(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.name < b.name; }));
    for (const auto table : {deviceTable(), handTable()})
        for (const DeviceInfo& device : table) CHECK(findDevice(device.name, all));
    REQUIRE(findDevice("inverse3", all));
    CHECK_FALSE(findDevice("inverse3", deviceTable()));
    CHECK_THAT(std::string(findDevice("inverse3", all)->summary), Contains("force only"));
}

// -- Normal operation ----------------------------------------------------------------------------------------------

TEST_CASE("inverse3: reads pose and buttons and writes the force, with services 3.1 and 3.5", "[device]") {
    const std::string version = GENERATE("", "old");
    INFO(version);
    InverseStandIn arm(version);
    // At rest the force displaces the hand's spring of 0.5 N/mm by 4 mm.
    const Vec3 p(10, 24, 30), turn(0, 0.3, 0.4);
    std::optional<Ticked> opened;
    CHECK(within([&] {
        if (!opened || !opened->undisturbed()) {
            opened.reset();
            arm.hand({0, 0, 0});
            opened.emplace(arm.open(kStale));
            opened->wrench = {{0, 2, 0}, {0, 0, 20}};
            opened->tick();  // before the hand moves, so that the pose is mapped from where it is now
            arm.fake.hand({10, 20, 30}, turn);
            arm.fake.buttons(5);
        }
        opened->tick();
        const Pose& X = opened->reading.X_WT_device;
        return opened->undisturbed() && (X.p - p).norm() < 0.01 && X.q.angularDistance(expRotation(turn)) < 1e-4 &&
               arm.pushes();
    }));
    CHECK(opened->reading.buttons == 5);
    const DeviceLimits limits = opened->device->limits();
    CHECK_FALSE(limits.torque);
    CHECK(limits.peakForce == 5);
    CHECK(limits.continuousForce == 2);
    const DeviceStatus status = opened->status();
    CHECK(status.rate > 0);
    CHECK_THAT(status.text, Contains("Inverse3 049D runs") && Contains("force only"));
    CHECK_THAT(status.details, Contains(version.empty() ? "'vector'" : "'values'") && Contains("right-handed") &&
                                   Contains("firmware F-1") && Contains("no torque") && Contains("VerseGrip gives"));
    CHECK(arm.fake.state().misuses == 0);
    opened.reset();
    CHECK(within([&] { return arm.fake.state().connections == 0; }));
    CHECK(arm.fake.state().lastWasZero);
    CHECK(arm.rests());
}

TEST_CASE("inverse3: without a VerseGrip the orientation stays fixed, and this is said", "[device]") {
    InverseStandIn arm("no-grip");
    Ticked ticked(arm.open(kStale));
    ticked.tick();
    arm.fake.hand({5, 0, 0}, {0, 0, 1});
    REQUIRE(ticked.until([&] { return ticked.reading.X_WT_device.p.x() > 4; }));
    CHECK(ticked.reading.X_WT_device.q.coeffs() == Quat::Identity().coeffs());
    CHECK_THAT(ticked.status().text, Contains("without a VerseGrip the orientation stays fixed"));
    CHECK_THAT(ticked.status().details, Contains("No VerseGrip"));
}

TEST_CASE("inverse3: large messages in fragments are states as any", "[device]") {
    InverseStandIn arm;
    Ticked ticked(arm.open("stale=1000"));
    ticked.wrench = arm.push();
    REQUIRE(ticked.until([&] { return arm.pushes(); }));
    arm.fake.fault("large");
    arm.hand({7, 0, 0});
    CHECK(ticked.until([&] { return ticked.reading.valid && ticked.reading.X_WT_device.p.x() > 6; }));
    CHECK(arm.fake.state().misuses == 0);
}

TEST_CASE("inverse3: two holders share one connection", "[device]") {
    InverseStandIn arm;
    Ticked first(arm.open());
    first.tick();
    auto second = std::make_unique<Ticked>(arm.open());
    second->wrench = arm.push();
    CHECK(second->until([&] { return arm.pushes(); }));
    CHECK(arm.fake.state().connections == 1);
    second.reset();
    CHECK(arm.fake.state().connections == 1);
}

// -- Refusals ------------------------------------------------------------------------------------------------------

TEST_CASE("inverse3: what does not answer as the service is refused in one sentence", "[device]") {
    int unused = 0;
    {
        const FakeInverse gone;
        unused = gone.port();
    }
    CHECK_THAT(refusal("port=" + std::to_string(unused)),
               Contains("no device at port " + std::to_string(unused)) && Contains("Install and start"));
    setenv("TOUCHSTONE_INVERSE", std::to_string(unused).c_str(), 1);
    const DeviceCheck check = examineInverse3();
    CHECK_FALSE(check.works);
    CHECK_THAT(check.text, Contains("Haply's Inverse Service") && Contains("systemctl"));
    unsetenv("TOUCHSTONE_INVERSE");

    const auto [fault, words] = GENERATE(table<std::string, std::string>({
        {"hello", "no inventory of devices"},
        {"garbage", "no inventory of devices"},
        {"no-device", "no Inverse3: connect and power it"},
        {"uncalibrated", "lacks its calibration: "},
        {"unpowered", "lacks its power supply: "},
        {"other-basis", "axes 'XZY'"},
        {"missing", "lacks a valid position"},
        {"malformed", "no JSON"},
        {"nothing", "it sends no inventory"},
        {"silent", "it sends no state"},
        {"disconnect", "ended the connection"},
    }));
    INFO(fault);
    const FakeInverse fake(fault);
    CHECK_THAT(refusal(fake.options()), Contains(words));
    CHECK(fake.state().peakForce == 0);
    CHECK(within([&] { return fake.state().connections == 0; }));
}

TEST_CASE("inverse3: doctor's examination names the device", "[device]") {
    const FakeInverse fake;
    setenv("TOUCHSTONE_INVERSE", std::to_string(fake.port()).c_str(), 1);
    const DeviceCheck check = examineInverse3();
    unsetenv("TOUCHSTONE_INVERSE");
    CHECK(check.works);
    CHECK_THAT(check.text, Contains("Inverse3 049D runs, with force only"));
    CHECK(fake.state().peakForce == 0);
}

// -- The safety matrix ---------------------------------------------------------------------------------------------

TEST_CASE("inverse3: faults are named and zero the force until the device is engaged again", "[device]") {
    const auto [fault, words] = GENERATE(table<std::string, std::string>({
        {"malformed", "a message that is no JSON"},
        {"nan", "a message that is no JSON"},
        {"infinity", "a message that is no JSON"},
        {"null", "lacks the position, or it is no finite number"},
        {"missing", "lacks the position"},
        {"far", "a position beyond 1 km"},
        {"unpowered", "lost its power supply"},
        {"uncalibrated", "its calibration"},
        {"grip-gone", "The VerseGrip is gone or asleep"},
        {"grip-asleep", "The VerseGrip is gone or asleep"},
        {"silent", "The service does not reply"},
        {"slow", "fewer than 250 messages a second"},
        {"event device-safety-triggered warning stall_detected", "'device-safety-triggered', stall_detected"},
        {"event device-safety-triggered error ebrake_triggered", "ebrake_triggered: as asked"},
        {"event device-safety-triggered warning fod_stage_changed", "fod_stage_changed"},
        {"event device-busy warning", "'device-busy'"},
        {"event device-battery-critical error", "'device-battery-critical'"},
        {"event an-event-of-the-future panic", "'an-event-of-the-future'"},
    }));
    InverseStandIn arm;
    if (fault == "slow" || fault.rfind("grip", 0) == 0) {
        // Their ends are faults too: a grip that is there again, and a mean period that falls slowly.
        INFO(fault);
        Ticked ticked(arm.open());
        ticked.wrench = arm.push();
        REQUIRE(ticked.until([&] { return arm.pushes(); }));
        arm.inject(fault);
        REQUIRE(ticked.until([&] { return ticked.reading.fault; }));
        CHECK_THAT(ticked.status().text, Contains(words));
        CHECK(ticked.until([&] { return arm.rests(); }));
        CHECK(ticked.status().state == State::Fault);
        if (fault == "slow") CHECK(ticked.status().rate < 250);
    } else {
        checkFault(arm, fault, words);
    }
}

TEST_CASE("inverse3: a grip that goes leaves the orientation, and one that comes must be engaged", "[device]") {
    InverseStandIn arm;
    Ticked ticked(arm.open(kStale));
    ticked.wrench = arm.push();
    const auto engage = [&] {
        REQUIRE(ticked.until([&] { return !ticked.reading.fault && ticked.reading.valid; }));
        CHECK(arm.rests());
        ticked.device->engage(ticked.reading.X_WT_device);
        REQUIRE(ticked.until([&] { return arm.pushes(); }));
    };
    REQUIRE(ticked.until([&] { return arm.pushes(); }));
    arm.fake.hand({0, 0, 0}, {0, 0, 0.4});
    REQUIRE(ticked.until([&] {
        return ticked.reading.X_WT_device.q.angularDistance(expRotation({0, 0, 0.4})) < 1e-6;
    }));
    arm.inject("grip-gone");
    REQUIRE(ticked.until([&] { return ticked.reading.fault; }));
    engage();
    CHECK(ticked.reading.X_WT_device.q.angularDistance(expRotation({0, 0, 0.4})) < 1e-6);
    CHECK_THAT(ticked.status().text, Contains("the orientation stays fixed"));

    arm.fake.hand({0, 0, 0}, {0, 0, 1.4});
    arm.clear();
    REQUIRE(ticked.until([&] { return ticked.reading.fault; }));
    CHECK_THAT(ticked.status().text, Contains("A VerseGrip has appeared"));
    engage();
    CHECK(ticked.reading.X_WT_device.q.angularDistance(expRotation({0, 0, 0.4})) < 1e-6);  // no jump
    arm.fake.hand({0, 0, 0}, {0, 0, 1.5});
    CHECK(ticked.until([&] { return ticked.reading.X_WT_device.q.angularDistance(expRotation({0, 0, 0.5})) < 1e-6; }));
}

TEST_CASE("inverse3: a lost device is reported, and is restored on request", "[device]") {
    const auto [fault, words] = GENERATE(table<std::string, std::string>({
        {"disconnect", "The service ended the connection"},
        {"unplugged", "no longer connected to the service"},
        {"huge", "a message of more than 1 MiB"},
        {"event device-disconnected warning", "no longer connected to the service"},
    }));
    InverseStandIn arm;
    Ticked ticked(arm.open(kStale));
    checkLost(arm, ticked, fault, words, kStale);
    if (fault == "unplugged") {  // it is still missing
        ticked.device->control()->reconnect();
        REQUIRE(ticked.until([&] { return ticked.status().state == State::Lost; }));
        CHECK_THAT(ticked.status().text, Contains("the service has no Inverse3"));
        CHECK(ticked.reading.fault);
    }
    checkReconnects(arm, ticked);
}

TEST_CASE("inverse3: a wrench that is not renewed drops to zero", "[device]") {
    InverseStandIn arm;
    checkUnrenewed(arm);
}

TEST_CASE("inverse3: the driver's output is finite and within the limits", "[device]") {
    InverseStandIn arm;
    checkLimits(arm);
    CHECK(arm.fake.state().peakForce < 5 + 1e-9);
}

TEST_CASE("inverse3: events of other devices and mere notices are no faults", "[device]") {
    InverseStandIn arm;
    Ticked ticked(arm.open());
    ticked.wrench = arm.push();
    REQUIRE(ticked.until([&] { return arm.pushes(); }));
    arm.fake.event("device-safety-triggered", "notice", "ebrake_released");
    arm.fake.event("device-safety-triggered", "info", "fod_stage_changed");
    arm.fake.event("device-connected", "info", "", "04BA");
    arm.fake.event("device-disconnected", "warning", "", "04BA");
    arm.fake.event("device-safety-triggered", "error", "ebrake_triggered", "04BA");
    arm.fake.event("device-battery-low", "warning");
    ticked.tickFor(200);
    CHECK_THAT(ticked.status().details, !Contains("Errors so far"));
    // After them one that is a fault: the channel was heard.
    arm.inject("event device-safety-triggered warning stability_ceiling");
    CHECK(ticked.until([&] { return ticked.reading.fault; }));
}

TEST_CASE("inverse3: a missing channel of events is said, and its end is a fault", "[device]") {
    InverseStandIn arm;
    {
        Ticked ticked(openInverse("port=" + std::to_string(arm.fake.port()) + ",events=1"));
        CHECK(ticked.until([&] { return ticked.reading.valid; }));
        CHECK_THAT(ticked.status().details, Contains("No channel of events at port 1"));
    }
    Ticked ticked(arm.open());
    ticked.wrench = arm.push();
    REQUIRE(ticked.until([&] { return arm.pushes(); }));
    REQUIRE(ticked.until([&] { return ticked.status().details.find("No channel") == std::string::npos; }));
    arm.fake.endEvents();
    REQUIRE(ticked.until([&] { return ticked.reading.fault; }));
    CHECK_THAT(ticked.status().text, Contains("ended its channel of events"));
    CHECK(ticked.until([&] { return arm.rests(); }));
}

TEST_CASE("inverse3: releasing the forces sends a zero force at once, and holds it", "[device][safety]") {
    InverseStandIn arm;
    Ticked ticked(arm.open());
    ticked.wrench = arm.push();
    REQUIRE(ticked.until([&] { return arm.pushes(); }));
    ticked.device->releaseForces();
    CHECK(within([&] { return arm.rests(); }));
    ticked.tickFor(100);
    CHECK(arm.rests());
    CHECK(arm.fake.state().misuses == 0);  // the frame past the library is well-formed
    // The exchange goes on, and can be engaged again.
    ticked.device->engage(ticked.reading.X_WT_device);
    CHECK(ticked.until([&] { return arm.pushes(); }));
}

}  // namespace touchstone::inverse3_tests
