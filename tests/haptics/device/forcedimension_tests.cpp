// Tests the driver against a fake of the vendor's libraries, in normal operation and for each fault.
#include "haptics/device/forcedimension.hpp"

#include "haptics/device/device_table.hpp"
#include "haptics/device/dhd_library.hpp"
#include "haptics/device/forcedimension_link.hpp"
#include "tests/support/arm_matrix.hpp"
#include "tests/support/fake_dhd/fake_dhd_device.hpp"

namespace touchstone::forcedimension_tests {

using namespace touchstone::test;
using Catch::Contains;
using State = DeviceStatus::State;

namespace {

constexpr const char* kPatient = "stale=500";  // a busy machine delays threads

/// For the safety matrix.
class SigmaStandIn final : public ArmStandIn {
  public:
    explicit SigmaStandIn(const std::string& faults = {}) : fake(faults) {}
    std::unique_ptr<Device> open(const std::string& options = {}) override {
        return openForceDimension(kPatient + (options.empty() ? "" : "," + options));
    }
    Vec3 force() const override { return fake.force(); }
    Vec3 torque() const override { return fake.torque(); }
    void hand(const Vec3& p) override { fake.hand(p); }
    Vec3 position() const override { return fake.position(); }
    void inject(const std::string& fault) override { fake.fault(fault.c_str()); }
    void clear() override { fake.fault(""); }

    FakeDhd fake;
};

std::string refusal(const std::string& text = {}, bool window = false) {
    try {
        openForceDimension(text, {}, window);
    } catch (const std::runtime_error& e) {
        return e.what();
    }
    return {};
}

}  // namespace

// -- Loading and opening -------------------------------------------------------------------------------------------

TEST_CASE("forcedimension: a missing library is reported with the names tried, the loader's message and a remedy",
          "[device]") {
    setenv("TOUCHSTONE_LIBDHD", "/no/such/libdhd.so", 1);
    CHECK_THAT(refusal(), Contains("/no/such/libdhd.so: ") && Contains("cannot open shared object file") &&
                              Contains("Install the vendor's SDK"));
    CHECK_THAT(refusal("library=/not/here.so"), Contains("/not/here.so: ") && !Contains("/no/such"));
    unsetenv("TOUCHSTONE_LIBDHD");
    if (dlopen("libdhd.so.3", RTLD_NOW) || dlopen("libdhd.so", RTLD_NOW)) return;
    CHECK_THAT(refusal(), Contains("libdhd.so.3: ") && Contains("libdhd.so: "));
}

TEST_CASE("forcedimension: a library that lacks a symbol is reported with the symbol's name", "[device]") {
    setenv("TOUCHSTONE_LIBDHD", FakeDhd::kIncomplete, 1);
    CHECK_THAT(refusal(), Contains("libdhd_incomplete.so") && Contains("lacks dhdGetStatus."));
    const DeviceCheck check = examineForceDimension();
    CHECK_FALSE(check.works);
    CHECK_THAT(check.text, Contains("dhdGetStatus"));
    unsetenv("TOUCHSTONE_LIBDHD");
}

TEST_CASE("forcedimension: finds a library whose name has the full version, without DRD", "[device]") {
    const FakeDhd fake("", FakeDhd::kAlone);
    unsetenv("TOUCHSTONE_LIBDHD");
    const char* before = std::getenv("LD_LIBRARY_PATH");
    const std::string saved = before ? before : "";
    setenv("LD_LIBRARY_PATH", TOUCHSTONE_BINARY_DIR "/fakes/dhd_alone", 1);
    if (dlopen("libdhd.so.3", RTLD_NOW | RTLD_NOLOAD))
        WARN("another libdhd.so.3 is loaded: this one is not looked for");
    const dhd::Library library = dhd::load();
    before ? setenv("LD_LIBRARY_PATH", saved.c_str(), 1) : unsetenv("LD_LIBRARY_PATH");
    CHECK(library.open);
    CHECK_THAT(library.name, Contains("libdhd.so.3"));
}

TEST_CASE("forcedimension: a device that cannot be opened is reported with the library's reason", "[device]") {
    const auto [fault, words] = GENERATE(table<std::string, std::string>({
        {"no-device", "no device is connected (error 5, 'no device found')"},
        {"no-driver", "lacks the driver"},
        {"in-use", "another program uses the device"},
    }));
    const FakeDhd fake(fault);
    CHECK_THAT(refusal(), Contains("opens no device") && Contains(words));
    CHECK(fake.state().open == 0);
}

TEST_CASE("forcedimension: unknown options are refused by name", "[device]") {
    CHECK_THAT(refusal("init=perhaps"), Contains("'init=perhaps' is not an option"));
    CHECK_THAT(refusal("rate=1"), Contains("'rate=1'"));
    const ForceDimensionOptions options =
        forceDimensionOptions("init=auto,library=x.so,serial=7,rate=2000,stale=8,force=5,torque=60");
    CHECK(options.autoInit);
    CHECK(options.library == "x.so");
    CHECK(options.serial == 7);
    CHECK(options.rate == 2000);
    CHECK(options.staleMs == 8);
    CHECK(options.peakForce == 5);
    CHECK(options.peakTorque == 60);
}

TEST_CASE("forcedimension: opens the device of a serial number", "[device]") {
    const FakeDhd fake;
    CHECK_THAT(refusal("serial=4321"), Contains("no device is connected"));
    CHECK(refusal("serial=1234").empty());
}

TEST_CASE("forcedimension: every error of the library and every cause of forces off has its own text", "[device]") {
    for (unsigned code = 2; code <= 21; ++code) CHECK_THAT(dhd::words(code), !Contains("unknown error"));
    for (unsigned cause = 0; cause <= 6; ++cause)
        CHECK_THAT(dhd::words(dhd::kForcesOff + cause), !Contains("does not know") && !Contains("unknown error"));
    CHECK_THAT(dhd::words(dhd::kForcesOff + 42), Contains("does not know"));
}

// -- Initializing --------------------------------------------------------------------------------------------------

TEST_CASE("forcedimension: a device that is not initialized does not move unasked", "[device]") {
    const FakeDhd fake("uncalibrated");
    CHECK_THAT(refusal(), Contains("not initialized") && Contains("init=auto") && Contains("calibration pole"));
    CHECK_THAT(refusal("init=hand"), Contains("init=auto"));
    const DeviceCheck check = examineForceDimension();
    CHECK_FALSE(check.works);
    CHECK_THAT(check.text, Contains("not initialized"));
    CHECK(fake.state().moves == 0);
    CHECK(fake.state().open == 0);
}

TEST_CASE("forcedimension: init=auto lets it initialize itself, once", "[device]") {
    const FakeDhd fake("uncalibrated");
    const SigmaStandIn arm("uncalibrated");
    Ticked sigma(openForceDimension("init=auto,stale=500"));
    CHECK(sigma.until([&] { return sigma.reading.valid; }));
    CHECK(fake.state().moves == 1);
    CHECK(sigma.status().state == State::Running);
    CHECK(fake.state().misuses == 0);
}

TEST_CASE("forcedimension: a failed initialization is named, and nothing stays open", "[device]") {
    const auto [fault, words] = GENERATE(table<std::string, std::string>({
        {"uncalibrated,init-fails", "did not answer in time (error 7, 'timeout occurred')"},
        {"uncalibrated,init-in-vain", "still not initialized"},
        {"uncalibrated,unsupported", "DRD does not support it"},
    }));
    const FakeDhd fake(fault);
    CHECK_THAT(refusal("init=auto"), Contains(words));
    CHECK(fake.state().open == 0);
}

TEST_CASE("forcedimension: in the window it initializes itself after consent, and is then engaged deliberately",
          "[device]") {
    const FakeDhd fake("uncalibrated,init-fails");
    Ticked sigma(openForceDimension(kPatient, {}, true));
    sigma.wrench = {{0, 2, 0}, {0, 0, 0}};
    sigma.tickFor(50);
    CHECK_FALSE(sigma.reading.valid);
    CHECK(sigma.status().state == State::Fault);
    CHECK_THAT(sigma.status().text, Contains("not initialized"));
    CHECK_THAT(sigma.status().consent, Contains("moves on its own"));
    sigma.device->engage({});
    sigma.tickFor(50);
    CHECK(fake.released());
    CHECK(fake.state().motors == 0);
    CHECK(fake.state().moves == 0);

    sigma.device->control()->selfInitialize();
    REQUIRE(sigma.until([&] { return sigma.status().state == State::Fault; }));
    CHECK_THAT(sigma.status().text, Contains("did not initialize itself"));
    CHECK(fake.state().moves == 1);
    fake.fault("");
    sigma.device->control()->selfInitialize();
    REQUIRE(sigma.until([&] { return sigma.reading.valid && !sigma.reading.fault; }));
    CHECK(fake.state().moves == 2);
    sigma.tickFor(50);
    CHECK(fake.released());
    CHECK(sigma.status().consent.empty());
    sigma.device->engage(sigma.reading.X_WT_device);
    CHECK(sigma.until([&] { return fake.force() == sigma.wrench.force; }));
    CHECK(sigma.status().state == State::Running);
    CHECK(fake.state().misuses == 0);
}

TEST_CASE("forcedimension: without DRD the user initializes the device by hand", "[device]") {
    const FakeDhd fake("uncalibrated", FakeDhd::kAlone);
    CHECK_THAT(refusal("init=auto"), Contains("DRD cannot be loaded") && Contains("libdrd") && Contains("by hand"));
    Ticked sigma(openForceDimension(kPatient, {}, true));
    sigma.wrench = {{0, 2, 0}, {0, 0, 0}};
    sigma.tickFor(20);
    CHECK_THAT(sigma.status().text, Contains("by hand"));
    CHECK(sigma.status().consent.empty());
    sigma.device->engage({});
    fake.calibrate();
    REQUIRE(sigma.until([&] { return sigma.reading.valid && !sigma.reading.fault; }));
    sigma.tickFor(50);
    CHECK(fake.released());
    sigma.device->engage(sigma.reading.X_WT_device);
    CHECK(sigma.until([&] { return fake.force() == sigma.wrench.force; }));
}

// -- Normal operation ----------------------------------------------------------------------------------------------

TEST_CASE("forcedimension: reads pose and buttons, writes the wrench in the library's axes and units, and closes",
          "[device]") {
    SigmaStandIn arm;
    {
        // At rest the wrench displaces the hand's spring of 0.5 N/mm by 4 mm, and its torsion spring of 1012.5
        // mN·m/rad.
        const Vec3 p(10, 24, 30);
        const Quat q = expRotation(Vec3(0, 0, 0.5 + 20 / 1012.5));
        std::optional<Ticked> opened;
        CHECK(within([&] {
            if (!opened || !opened->undisturbed()) {
                opened.reset();
                opened.emplace(arm.open());
                opened->wrench = arm.push();
                opened->tick();  // before the hand moves, so that the pose is mapped from where it is now
                arm.fake.hand({10, 20, 30}, {0, 0, 0.5});
                arm.fake.buttons(5);
            }
            opened->tick();
            const Pose& X = opened->reading.X_WT_device;
            return opened->undisturbed() && (X.p - p).norm() < 0.01 && X.q.angularDistance(q) < 1e-4 && arm.pushes();
        }));
        const Ticked& sigma = *opened;
        const DeviceLimits limits = sigma.device->limits();
        CHECK(limits.peakForce == 12);
        CHECK(limits.peakTorque == 200);
        CHECK(limits.torque);
        CHECK(limits.nominalStiffness == 4);
        CHECK(sigma.reading.buttons == 5);
        CHECK_THAT(sigma.status().details,
                   Contains("libdhd.so.3") && Contains("libdrd.so.3") && Contains("fake sigma.7, type 104"));
        CHECK(sigma.status().rate > 0);
        CHECK(arm.fake.state().gripper == 0);
    }
    CHECK(arm.rests());
    CHECK(arm.fake.state().motors == 0);
    CHECK(arm.fake.state().open == 0);
    CHECK(arm.fake.state().misuses == 0);  // the fake counts calls without the device's ID
}

TEST_CASE("forcedimension: the library's axes are a rotation of ours", "[device]") {
    const FakeDhd fake;
    Ticked sigma(openForceDimension(kPatient));
    sigma.tick();
    // One of our axes after the other, as a push and as a turn.
    for (int axis = 0; axis < 3; ++axis) {
        const Vec3 e = Vec3::Unit(axis);
        fake.hand(20 * e, 0.3 * e);
        CHECK(sigma.until([&] {
            const Pose& X = sigma.reading.X_WT_device;
            return (X.p - 20 * e).norm() < 0.05 && X.q.angularDistance(expRotation(0.3 * e)) < 1e-3;
        }));
        sigma.wrench = {1.5 * e, 8 * e};
        CHECK(sigma.until([&] { return fake.force() == sigma.wrench.force && fake.torque() == sigma.wrench.torque; }));
        sigma.wrench = {};
    }
}

TEST_CASE("forcedimension: results 1 and 2 are not errors", "[device]") {
    SigmaStandIn arm("timeguard,saturated");
    Ticked sigma(arm.open());
    sigma.wrench = arm.push();
    CHECK(sigma.until([&] { return arm.pushes() && sigma.reading.valid; }));
    CHECK(sigma.status().state == State::Running);
    CHECK_THAT(sigma.status().details, Contains("saturated motors") && !Contains("Errors"));
}

TEST_CASE("forcedimension: a device without active rotations gives no torque, and says so", "[device]") {
    const FakeDhd fake("omega6");
    Ticked omega(openForceDimension(kPatient));
    omega.wrench = {{0, 2, 0}, {0, 0, 20}};
    CHECK(omega.until([&] { return fake.force() == omega.wrench.force; }));
    CHECK(fake.torque().isZero());
    CHECK_FALSE(omega.device->limits().torque);
    CHECK_THAT(omega.status().details, Contains("Force only"));
}

TEST_CASE("forcedimension: a limit that is set in the library holds", "[device]") {
    const FakeDhd fake("max-force");
    CHECK(openForceDimension(kPatient)->limits().peakForce == 3);
}

// -- The safety matrix ---------------------------------------------------------------------------------------------

TEST_CASE("forcedimension: faults are named and zero the force until the device is engaged again", "[device]") {
    const auto [fault, words] = GENERATE(table<std::string, std::string>({
        {"geometry", "geometry has no solution"},
        {"redundant", "encoders disagree"},
        {"set-fails", "unknown error"},
        {"controller-error", "controller reports an error"},
        {"button", "force button switched the forces off"},
        {"velocity", "moved faster than its threshold"},
        {"watchdog", "watchdog switched the forces off"},
        {"software", "software switched the forces off"},
        {"deadman", "dead-man switch"},
        {"unknown-cause", "a cause that this program does not know"},
        {"slow", "too slow for a stiff wall"},
    }));
    SigmaStandIn arm;
    checkFault(arm, fault, words);
    CHECK(arm.fake.state().misuses == 0);
}

TEST_CASE("forcedimension: a lost device zeroes the force, is reported, and is restored on request", "[device]") {
    const auto [fault, words] = GENERATE(table<std::string, std::string>({
        {"com", "communication with the device failed"},
        {"timeout", "did not answer in time"},
        {"status-fails", "communication with the device failed"},
        {"no-power", "no power"},
        {"usb", "cable was unplugged"},
    }));
    SigmaStandIn arm;
    Ticked sigma(arm.open());
    checkLost(arm, sigma, fault, words, "");
    checkReconnects(arm, sigma);
    CHECK(arm.fake.state().open == 1);
    CHECK(arm.fake.state().misuses == 0);
}

TEST_CASE("forcedimension: a device that is still unplugged stays lost", "[device]") {
    SigmaStandIn arm;
    Ticked sigma(arm.open());
    checkLost(arm, sigma, "com", "communication", "");
    setenv("FAKE_DHD_FAULT", "no-device", 1);
    sigma.device->control()->reconnect();
    REQUIRE(sigma.until([&] { return sigma.status().state == State::Lost; }));
    CHECK_THAT(sigma.status().text, Contains("opens no device"));
    CHECK(sigma.reading.fault);
}

TEST_CASE("forcedimension: a library that hangs is reported, and what follows is a fault", "[device]") {
    SigmaStandIn arm;
    Ticked sigma(openForceDimension(""));  // poses are stale soon
    sigma.wrench = arm.push();
    REQUIRE(sigma.until([&] { return arm.pushes(); }));
    arm.inject("stall");
    CHECK(sigma.until([&] { return !sigma.reading.valid && arm.rests(); }));  // the device's watchdog
    CHECK(sigma.until([&] { return sigma.status().state == State::Lost; }));
    CHECK_THAT(sigma.status().text, Contains("does not answer"));
    arm.clear();
    CHECK(sigma.until([&] { return sigma.reading.fault; }));
    REQUIRE(sigma.until([&] { return sigma.reading.valid && !sigma.reading.fault; }));
    sigma.tickFor(50);
    CHECK(arm.rests());
    CHECK(sigma.status().state == State::Fault);
    sigma.device->engage(sigma.reading.X_WT_device);
    CHECK(sigma.until([&] { return arm.pushes(); }));
}

TEST_CASE("forcedimension: a library that returns after it hung is a fault, also where no watchdog acts", "[device]") {
    SigmaStandIn arm("no-watchdog");
    Ticked sigma(arm.open());
    sigma.wrench = arm.push();
    REQUIRE(sigma.until([&] { return arm.pushes(); }));
    arm.inject("stall,no-watchdog");
    REQUIRE(sigma.until([&] { return sigma.status().state == State::Lost; }));
    arm.inject("no-watchdog");
    REQUIRE(sigma.until([&] { return sigma.reading.fault; }));
    CHECK(sigma.until([&] { return arm.rests(); }));
    CHECK_THAT(sigma.status().text, Contains("did not answer for more than 0.1 s"));
    sigma.tickFor(50);
    CHECK(arm.rests());
}

TEST_CASE("forcedimension: a pose that is not finite, far away or no rotation is invalid", "[device]") {
    SigmaStandIn arm;
    Ticked sigma(arm.open());
    arm.inject(GENERATE("nan", "far", "skewed", "mirrored"));
    CHECK(sigma.until([&] { return !sigma.reading.valid; }));
    CHECK(sigma.reading.X_WT_device.isValid());
    CHECK_THAT(sigma.status().details, Contains("Invalid poses"));
}

TEST_CASE("forcedimension: motors that refuse to switch on are a fault without force", "[device]") {
    SigmaStandIn arm("enable-fails");
    Ticked sigma(arm.open());
    sigma.wrench = arm.push();
    CHECK(sigma.until([&] { return sigma.reading.fault; }));
    CHECK(arm.rests());
    CHECK_THAT(sigma.status().text, Contains("not ready"));
}

TEST_CASE("forcedimension: a wrench that is not renewed drops to zero, and the output is finite and limited",
          "[device]") {
    SigmaStandIn arm;
    checkUnrenewed(arm);
    checkLimits(arm);
    CHECK(arm.fake.state().peakForce < 12 + 1e-9);
}

TEST_CASE("forcedimension: releasing the forces switches the motors off", "[device]") {
    SigmaStandIn arm;
    Ticked sigma(arm.open());
    sigma.wrench = arm.push();
    REQUIRE(sigma.until([&] { return arm.pushes(); }));
    sigma.device->releaseForces();
    CHECK(sigma.until([&] { return arm.fake.state().motors == 0; }));
}

TEST_CASE("forcedimension: two holders share one connection", "[device]") {
    SigmaStandIn arm;
    Ticked first(arm.open());
    first.tick();
    auto second = std::make_unique<Ticked>(arm.open());
    second->wrench = arm.push();
    CHECK(second->until([&] { return arm.pushes(); }));
    CHECK(arm.fake.state().open == 1);
    second.reset();
    CHECK(arm.fake.state().open == 1);
}

}  // namespace touchstone::forcedimension_tests
