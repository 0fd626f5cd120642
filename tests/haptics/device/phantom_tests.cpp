// Tests the driver against a fake of the vendor's library, in normal operation and for each fault.
#include "haptics/device/phantom.hpp"

#include <clocale>

#include "haptics/device/device_table.hpp"
#include "haptics/device/hd_library.hpp"
#include "haptics/device/phantom_link.hpp"
#include "tests/support/fake_hd/fake_hd_device.hpp"

namespace touchstone::phantom_tests {

using namespace touchstone::test;
using Catch::Contains;
using State = DeviceStatus::State;

namespace {

Ticked ticked(const std::string& options = {}) { return Ticked(openPhantom(options)); }

const Wrench kPush{{0, 2, 0}, {0, 0, 20}};

}  // namespace

TEST_CASE("phantom: a missing library is reported with the names tried, the loader's message and a remedy",
          "[device]") {
    setenv("TOUCHSTONE_LIBHD", "/no/such/libHD.so", 1);
    CHECK_THAT(refusal(), Contains("/no/such/libHD.so: ") && Contains("cannot open shared object file") &&
                              Contains("Install") && Contains("libPHANToMIO.so.4") && Contains("libPhantomIOLib42.so"));
    CHECK_THAT(refusal(",library=/not/here.so"), Contains("/not/here.so: ") && !Contains("/no/such"));
    unsetenv("TOUCHSTONE_LIBHD");
    if (dlopen("libHD.so", RTLD_NOW) || dlopen("libHD.so.3", RTLD_NOW) || dlopen("libHD.so.3.0", RTLD_NOW)) return;
    CHECK_THAT(refusal(), Contains("libHD.so: ") && Contains("libHD.so.3.4: ") && Contains("libHD.so.3: ") &&
                              Contains("libHD.so.3.0: "));
}

TEST_CASE("phantom: a driver that libHD needs and does not find is named, for both generations", "[device]") {
    const auto [library, words, other] = GENERATE(table<std::string, std::string, std::string>({
        {"libfake_hd_without_PhantomIOLib42.so", "Touch Device Driver, which brings libPhantomIOLib42.so", "PHANToMIO"},
        {"libfake_hd_without_PHANToMIO.so", "PHANTOM Device Drivers 4.3, which bring libPHANToMIO.so.4", "IOLib42"},
    }));
    setenv("TOUCHSTONE_LIBHD", (TOUCHSTONE_BINARY_DIR "/fakes/" + library).c_str(), 1);
    CHECK_THAT(refusal(),
               Contains(library) && Contains("cannot open shared object file") && Contains(words) && !Contains(other));
    CHECK_THAT(examinePhantom().text, Contains(words));
    unsetenv("TOUCHSTONE_LIBHD");
    CHECK_THAT(hd::remedy("libHD.so: libncurses.so.5: cannot open shared object file"),
               Contains("apt install libncurses5"));
}

TEST_CASE("phantom: a library that lacks a symbol is reported with the symbol's name", "[device]") {
    setenv("TOUCHSTONE_LIBHD", TOUCHSTONE_BINARY_DIR "/fakes/libfake_hd_incomplete.so", 1);
    CHECK_THAT(refusal(), Contains("libfake_hd_incomplete.so") && Contains("lacks hdUnschedule."));
    const DeviceCheck check = examinePhantom();
    CHECK_FALSE(check.works);
    CHECK_THAT(check.text, Contains("hdUnschedule"));
    unsetenv("TOUCHSTONE_LIBHD");
}

TEST_CASE("phantom: a missing device is reported with every name tried and why each failed", "[device]") {
    const FakeHd fake("no-device");
    CHECK_THAT(refusal("left"), Contains("'left': ") && Contains("the default: ") && Contains("'Default Device': ") &&
                                    Contains("'Default PHANToM': ") && Contains("0x0300") &&
                                    Contains("HD_DEVICE_FAULT") && Contains("Connect and power") &&
                                    Contains("set GTDD_HOME"));
    CHECK(fake.state().handles == 0);
}

TEST_CASE("phantom: the last of the names is also tried, and reported", "[device]") {
    const FakeHd fake("only-phantom");
    Ticked phantom = ticked();
    CHECK_THAT(phantom.status().details, Contains("'Default PHANToM', after the default: "));
}

TEST_CASE("phantom: does not start uncalibrated, and runs an automatic calibration without force", "[device]") {
    {
        const FakeHd fake("no-calibration");
        CHECK_THAT(refusal(), Contains("not calibrated") && Contains("reset position"));
        CHECK(fake.state().handles == 0);
    }
    {
        const FakeHd fake("inkwell,out-of-well");
        CHECK_THAT(refusal(), Contains("put the stylus into the inkwell and choose the device again"));
    }
    const FakeHd fake(GENERATE("update-calibration", "inkwell"));
    Ticked phantom = ticked();
    phantom.tick();
    CHECK(phantom.status().state == State::Running);
    CHECK(fake.state().misuses == 0);  // the fake counts calibrating under force
}

TEST_CASE("phantom: unknown options are refused by name", "[device]") {
    const FakeHd fake;
    CHECK_THAT(refusal("left,drive=nobody"), Contains("'drive=nobody' is not an option"));
    CHECK_THAT(refusal(",stale=never"), Contains("'stale=never'"));
    const PhantomOptions options = phantomOptions("left,drive=device,rate=500,gimbal,torque=60,stale=8,library=x.so");
    CHECK(options.name == "left");
    CHECK(options.deviceDrives);
    CHECK(options.rate == 500);
    CHECK(options.gimbalTorque);
    CHECK(options.peakTorque == 60);
    CHECK(options.staleMs == 8);
    CHECK(options.library == "x.so");
}

TEST_CASE("phantom: every error code of the library has its own text", "[device]") {
    for (const unsigned code : {0x100u, 0x101u, 0x102u, 0x103u, 0x104u, 0x200u, 0x201u, 0x202u, 0x203u, 0x204u, 0x300u,
                                0x301u, 0x302u, 0x303u, 0x304u, 0x400u, 0x401u, 0x402u, 0x500u, 0x501u, 0x600u}) {
        INFO(std::hex << code);
        CHECK_THAT(hd::words(code), !Contains("unknown error"));
    }
}

TEST_CASE("phantom: reads pose and buttons, writes the wrench, and takes limits and temperature from the device",
          "[device]") {
    const FakeHd fake;
    {
        // At rest the wrench displaces the hand's spring of 0.5 N/mm by 4 mm, and its torsion spring of 1012.5
        // mN·m/rad.
        const Vec3 p(10, 24, 30);
        const Quat q = expRotation(Vec3(0, 0, 0.5 + 20 / 1012.5));
        std::optional<Ticked> opened;
        CHECK(within([&] {
            if (!opened || !opened->undisturbed()) {
                opened.reset();
                opened.emplace(openPhantom(",stale=500"));
                opened->wrench = kPush;
                opened->tick();  // before the hand moves, so that the pose is mapped from where it is now
                fake.hand(10, 20, 30, 0, 0, 0.5);
                fake.buttons(5);
            }
            opened->tick();
            const Pose& X = opened->reading.X_WT_device;
            return opened->undisturbed() && (X.p - p).norm() < 0.01 && X.q.angularDistance(q) < 1e-4 &&
                   fake.force() == kPush.force && fake.torque() == kPush.torque;
        }));
        const Ticked& phantom = *opened;
        const DeviceLimits limits = phantom.device->limits();
        CHECK(limits.peakForce == 8);
        CHECK(limits.continuousForce == 2);
        CHECK(limits.peakTorque == 170);  // the library has no query for it
        CHECK(limits.nominalStiffness == 0.8);
        CHECK(phantom.reading.buttons == 5);
        const DeviceStatus status = phantom.status();
        CHECK(status.temperature == Approx(0.35));
        CHECK(status.rate > 0);
        CHECK_THAT(status.details, Contains("libfake_hd.so") && Contains("Fake Premium 6DOF") && Contains("F-1"));
        CHECK(fake.state().misuses == 0);
    }
    CHECK(fake.force().isZero());
    CHECK(fake.state().handles == 0);
    CHECK(fake.state().misuses == 0);
}

TEST_CASE("phantom: unreadable limits become the safe defaults", "[device]") {
    const FakeHd fake("no-limits");
    const DeviceLimits limits = ticked(",torque=40").device->limits(), defaults;
    CHECK(limits.peakForce == defaults.peakForce);
    CHECK(limits.continuousForce == defaults.continuousForce);
    CHECK(limits.peakTorque == 40);
    CHECK(limits.continuousTorque == 40);
    CHECK(limits.nominalStiffness == 1);
}

TEST_CASE("phantom: the driver's output is finite and within the limits", "[device]") {
    PhantomStandIn arm;
    checkLimits(arm);
    CHECK(arm.fake.state().peakForce < 8 + 1e-9);
}

TEST_CASE("phantom: faults are named and zero the force until the device is engaged again", "[device]") {
    const auto [fault, words] = GENERATE(table<std::string, std::string>({
        {"warm", "the motors are warm"},
        {"max-force", "the maximum force was exceeded"},
        {"impulse", "the force changed faster"},
        {"max-velocity", "the maximum velocity was exceeded"},
    }));
    PhantomStandIn arm;
    checkFault(arm, fault, words, true);
}

TEST_CASE("phantom: a lost connection zeroes the force, is reported, and is restored on request", "[device]") {
    PhantomStandIn arm;
    const std::string options = "stale=500";  // a sample of the old connection must not count for the new one
    Ticked phantom(arm.open(options));
    checkLost(arm, phantom, "comm", "connection to the device is lost: check cable and power (0x0302)", options);

    SECTION("plugged in again") {
        checkReconnects(arm, phantom);
        CHECK(arm.fake.state().handles == 1);
    }
    SECTION("still unplugged") {
        setenv("FAKE_HD_FAULT", "no-device", 1);
        phantom.device->control()->reconnect();
        REQUIRE(phantom.until([&] { return phantom.status().state == State::Lost; }));
        CHECK_THAT(phantom.status().text, Contains("opens no device"));
        CHECK(phantom.reading.fault);
    }
}

TEST_CASE("phantom: a stopped scheduler leaves a stale pose, and a missing one is reported", "[device]") {
    {
        const FakeHd fake;
        Ticked phantom = ticked();
        REQUIRE(phantom.until([&] { return phantom.reading.valid; }));
        fake.fault("dead");
        CHECK(phantom.until([&] { return !phantom.reading.valid; }));
    }
    const FakeHd fake("dead");
    CHECK_THAT(refusal(), Contains("never called back"));
    CHECK(fake.state().handles == 0);
}

TEST_CASE("phantom: a wrench that is not renewed drops to zero", "[device]") {
    PhantomStandIn arm;
    checkUnrenewed(arm);
}

TEST_CASE("phantom: a scheduler that is too slow for force is a fault", "[device]") {
    const FakeHd fake;
    Ticked phantom = ticked();
    phantom.wrench = kPush;
    REQUIRE(phantom.until([&] { return fake.force() == kPush.force; }));
    fake.fault("slow");
    REQUIRE(phantom.until([&] { return phantom.reading.fault; }));
    CHECK(phantom.until([&] { return fake.force().isZero(); }));
    CHECK_THAT(phantom.status().text, Contains("scheduler is too slow"));
    CHECK(phantom.status().rate < 250);
}

TEST_CASE("phantom: a non-finite or far transform is an invalid pose", "[device]") {
    const FakeHd fake;
    Ticked phantom = ticked();
    fake.fault(GENERATE("nan", "far"));
    CHECK(phantom.until([&] { return !phantom.reading.valid; }));
    CHECK(phantom.reading.X_WT_device.isValid());
}

TEST_CASE("phantom: without CURRENT_TORQUE there is only force, or gimbal torque with the option", "[device]") {
    const FakeHd fake("no-torque");
    const bool gimbal = GENERATE(false, true);
    Ticked phantom = ticked(gimbal ? ",gimbal" : "");
    phantom.wrench = kPush;
    REQUIRE(phantom.until([&] { return fake.force() == kPush.force; }));
    if (gimbal) {
        // With all joints at zero the gimbal's axes are y, x and z of the device.
        CHECK(phantom.until([&] { return (fake.torque() - Vec3(0, 0, 20)).norm() < 1; }));
        CHECK_THAT(phantom.status().details, Contains("gimbal's axes") && Contains("never tried on hardware"));
    } else {
        CHECK(fake.torque().isZero());
        CHECK_THAT(phantom.status().details, Contains("Forces only"));
    }
    CHECK(phantom.status().state == State::Running);
}

TEST_CASE("phantom: two holders share one connection", "[device]") {
    const FakeHd fake;
    Ticked first = ticked();
    first.tick();
    auto second = std::make_unique<Ticked>(openPhantom());
    second->wrench = kPush;
    CHECK(second->until([&] { return fake.force() == kPush.force; }));
    CHECK(fake.state().handles == 1);
    second.reset();
    CHECK(fake.state().handles == 1);
}

TEST_CASE("phantom: the library does not see a decimal comma of the user's locale", "[device]") {
    const std::string folder = TOUCHSTONE_BINARY_DIR "/locales";
    const std::string make = "mkdir -p '" + folder + "' && localedef --no-archive -i de_DE -f UTF-8 '" + folder +
                             "/de_DE.UTF-8' >'" + folder + "/log' 2>&1";
    [[maybe_unused]] const int made = std::system(make.c_str());
    setenv("LOCPATH", folder.c_str(), 1);
    if (!std::setlocale(LC_NUMERIC, "de_DE.UTF-8") || std::strtod("1.5", nullptr) == 1.5) {
        WARN("no locale with a decimal comma is available here: nothing was tested");
        return;
    }
    {
        const FakeHd fake;  // refuses to open if it reads 1.5 as 1
        CHECK(refusal().empty());
    }
    CHECK(std::strtod("1.5", nullptr) == 1);  // the user's locale is unchanged
    std::setlocale(LC_NUMERIC, "C");
    unsetenv("LOCPATH");
}

}  // namespace touchstone::phantom_tests
