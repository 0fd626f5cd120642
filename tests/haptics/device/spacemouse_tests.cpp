// Tests the driver against a fake of libspnav.
#include "haptics/device/spacemouse.hpp"

#include <dlfcn.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "haptics/device/control.hpp"
#include "haptics/device/device_table.hpp"

namespace touchstone::spacemouse_tests {

using Catch::Contains;

namespace {

constexpr const char* kFake = TOUCHSTONE_BINARY_DIR "/fakes/libfake_spnav.so";

struct FakeSpnav {
    explicit FakeSpnav(const char* how = "") {
        setenv("TOUCHSTONE_LIBSPNAV", kFake, 1);
        setenv("FAKE_SPNAV", how, 1);
    }
    ~FakeSpnav() { unsetenv("TOUCHSTONE_LIBSPNAV"); }

    static void* symbol(const char* name) { return dlsym(dlopen(kFake, RTLD_NOW), name); }
    static void send(int type, int a, int b, int c, int d = 0, int e = 0, int f = 0) {
        const int words[]{type, a, b, c, d, e, f};
        reinterpret_cast<void (*)(const int*)>(symbol("fakeSpnavSend"))(words);
    }
    static void die() { reinterpret_cast<void (*)()>(symbol("fakeSpnavDie"))(); }
};

std::unique_ptr<Device> open(const std::string& text = {}) {
    DeviceContext context;
    context.X_WT_start.p = {1, 2, 3};
    context.file = text;
    return makeSpaceMouse(context);
}

std::string refusal(const std::string& text = {}) {
    try {
        open(text);
    } catch (const std::runtime_error& e) {
        return e.what();
    }
    return {};
}

/// Reads until the sent event has arrived; the change in a tick is then the rate.
template <class F>
bool arrives(const F& done) {
    for (int i = 0; i < 5000; ++i) {
        if (done()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

/// Reads tick by tick.
struct Steps {
    Device& device;
    double t = 1;
    DeviceReading before{}, now{};

    /// Travel in the next tick, mm.
    Vec3 next() {
        before = now;
        now = device.read(t++, 1);
        return now.X_WT_device.p - before.X_WT_device.p;
    }
    /// Rotation in the next tick, rad.
    Vec3 nextTurn() {
        next();
        return logRotation(now.X_WT_device.q * before.X_WT_device.q.conjugate());
    }
};

}  // namespace

TEST_CASE("spacemouse: the rate is zero in the dead band, then grows to one", "[device]") {
    for (const int value : {0, 10, -30, 35}) CHECK(spaceMouseRate(value) == 0);
    CHECK(spaceMouseRate(350) == 1);
    CHECK(spaceMouseRate(-500) == -1);
    CHECK(spaceMouseRate(192) == Approx((192 / 350.0 - 0.1) / 0.9));
    CHECK(spaceMouseRate(36) > 0);
    CHECK(spaceMouseRate(36) < 0.01);  // no step at the edge of the dead band
}

TEST_CASE("spacemouse: a missing library or daemon is reported in one sentence", "[device]") {
    setenv("TOUCHSTONE_LIBSPNAV", "/no/such/libspnav.so", 1);
    CHECK_THAT(refusal(), Contains("/no/such/libspnav.so") && Contains("apt install libspnav0"));
    CHECK_FALSE(examineSpaceMouse().works);
    const FakeSpnav fake("none");
    CHECK(refusal() == "The SpaceMouse's daemon does not answer: start it with 'sudo systemctl start spacenavd'");
    CHECK_THAT(refusal("fast"), Contains("'fast' is not a speed"));
}

TEST_CASE("spacemouse: the cap sets the velocity right, up and toward the user", "[device]") {
    const FakeSpnav fake;
    const auto device = open("80");
    CHECK(device->read(0, 1).X_WT_device.p == Vec3(1, 2, 3));
    Steps steps{*device};
    steps.next();
    FakeSpnav::send(1, 350, 0, 350);
    // 80 mm/s; libspnav's z points away from the user.
    CHECK(arrives([&] { return (steps.next() - Vec3(0.08, 0, -0.08)).norm() < 1e-12; }));
    FakeSpnav::send(1, 0, 0, 0, 0, 350, 0);
    CHECK(arrives([&] { return (steps.nextTurn() - Vec3(0, 0.0016, 0)).norm() < 1e-9; }));
    FakeSpnav::send(2, 1, 1, 0);
    CHECK(arrives([&] { return steps.next(), steps.now.buttons == 2; }));
    FakeSpnav::send(1, 0, 0, 0);
    CHECK(arrives([&] { return steps.next().norm() == 0; }));
    // Engaged at the tool's pose, it continues from there.
    device->engage({{9, 9, 9}, Quat::Identity()});
    steps.next();
    CHECK(steps.now.X_WT_device.p == Vec3(9, 9, 9));
}

TEST_CASE("spacemouse: moves along the window's axes, while forces act along the scene's axes", "[device]") {
    const FakeSpnav fake;
    const auto device = open();
    const auto control = device->control();
    REQUIRE(control->maps() == DeviceControl::Maps::Axes);
    // The view is from the right: right in the picture is the scene's -z, toward the user its x.
    const Quat q_WD = expRotation(Vec3(0, M_PI / 2, 0));
    control->setWorkspace({.q_WD = q_WD});
    CHECK(control->workspace().q_WD.coeffs() == q_WD.coeffs());
    device->read(0, 1);
    Steps steps{*device};
    steps.next();
    FakeSpnav::send(1, 350, 0, 0);
    CHECK(arrives([&] { return (steps.next() - Vec3(0, 0, -0.05)).norm() < 1e-12; }));
    device->write({.force = {0, 0, 10}, .torque = Vec3::Zero()});
    CHECK(steps.next().norm() < 1e-12);
    device->write({});
    FakeSpnav::send(1, 0, 0, 0, 350, 0, 0);
    CHECK(arrives([&] { return (steps.nextTurn() - Vec3(0, 0, -0.001)).norm() < 1e-9; }));
    // The change takes one tick, without a jump.
    control->setWorkspace({});
    FakeSpnav::send(1, 0, 350, 0);
    CHECK(arrives([&] { return (steps.next() - Vec3(0, 0.05, 0)).norm() < 1e-12; }));
}

TEST_CASE("spacemouse: the device pose stops where contact holds the tool back", "[device]") {
    const FakeSpnav fake;
    const auto device = open();
    device->read(0, 1);
    DeviceReading before, now;
    double t = 1;
    const auto step = [&] {
        before = now;
        now = device->read(t++, 1);
        return now.X_WT_device.p.x() - before.X_WT_device.p.x();
    };
    FakeSpnav::send(1, 350, 0, 0);
    REQUIRE(arrives([&] { return step() == Approx(0.05); }));
    device->write({.force = {-5, 0, 0}});
    CHECK(step() == Approx(0.025));
    device->write({.force = {-12, 0, 0}});
    CHECK(step() == 0);
    device->write({.force = {5, 0, 0}});
    CHECK(step() == Approx(0.05));
}

TEST_CASE("spacemouse: a cap moves the tool from its push to its zero, in silence and in noise", "[device]") {
    const FakeSpnav fake;
    const auto device = open();
    device->read(0, 1);
    Steps steps{*device};
    steps.next();
    struct Push {
        int axis, value;
    };
    const auto send = [](const Push& push) {
        int axes[6]{};
        axes[push.axis] = push.value;
        FakeSpnav::send(1, axes[0], axes[1], axes[2], axes[3], axes[4], axes[5]);
    };
    // In a tick: mm along the first three axes, rad about the others.
    const auto travel = [&](const Push& push) { return push.axis < 3 ? steps.next().norm() : steps.nextTurn().norm(); };
    const Push push = GENERATE(Push{0, 350}, Push{2, 60}, Push{4, -200});
    INFO("axis " << push.axis << ", value " << push.value);
    const double expected = std::abs(spaceMouseRate(push.value)) * (push.axis < 3 ? 0.05 : 0.001);
    const auto moves = [&] { return travel(push) == Approx(expected).margin(1e-9); };
    const auto rests = [&] { return travel(push) < 1e-12; };
    send(push);
    REQUIRE(arrives(moves));
    SECTION("held still") {
        std::this_thread::sleep_for(std::chrono::milliseconds(700));  // longer than any pause of a moving hand
        CHECK(moves());
    }
    SECTION("events that repeat, and buttons") {
        for (int i = 0; i < 20; ++i) send(push), FakeSpnav::send(2, i % 2, 0, 0);
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        CHECK(moves());
    }
    SECTION("held on across a restart") {
        steps.t = 0;
        steps.next();
        steps.t = 1;
        CHECK(moves());
    }
    SECTION("unplugged") {
        FakeSpnav::send(3, 1, 0, 0);
        CHECK(arrives(rests));
    }
    send({push.axis, 0});
    CHECK(arrives(rests));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    CHECK(rests());
}

TEST_CASE("spacemouse: a lost daemon is a fault that stops a held cap, and a new daemon is found", "[device]") {
    const FakeSpnav fake;
    const auto device = open();
    device->read(0, 1);
    Steps steps{*device};
    steps.next();
    FakeSpnav::send(1, 350, 0, 0);
    REQUIRE(arrives([&] { return steps.next().norm() > 0; }));
    FakeSpnav::die();
    REQUIRE(arrives([&] { return steps.next(), steps.now.fault; }));
    CHECK_FALSE(steps.now.valid);
    CHECK(steps.next().norm() == 0);
    CHECK(device->control()->status().state == DeviceStatus::State::Lost);
    CHECK_THAT(device->control()->status().text, Contains("daemon is gone"));
    // Chosen again while the lost one still holds the tool.
    const auto again = open();
    CHECK(again->control()->status().state == DeviceStatus::State::Running);
    again->read(0, 1);
    CHECK(again->read(1, 1).X_WT_device.p == Vec3(1, 2, 3));  // the cap of the new daemon is at rest
    CHECK(steps.next().norm() == 0);
    FakeSpnav::send(1, 350, 0, 0);
    Steps more{*again};
    CHECK(arrives([&] { return more.next().x() == Approx(0.05); }));
    CHECK(steps.next().norm() == 0);
}

}  // namespace touchstone::spacemouse_tests
