// Maps the hand's space to the scene and back: without jumps, and without creating energy.
#include "haptics/device/workspace.hpp"

#include <catch2/catch.hpp>
#include <numbers>

#include "haptics/device/control.hpp"

namespace touchstone::workspace_tests {

namespace {

/// A device that the test controls.
struct Stylus {
    DeviceReading reading;
    Wrench felt;
    int engaged = 0;
};

class StylusDevice final : public Device {
  public:
    explicit StylusDevice(Stylus& stylus) : stylus_(stylus) {}
    DeviceReading read(double, double) noexcept override { return stylus_.reading; }
    void write(const Wrench& wrench) noexcept override { stylus_.felt = wrench; }
    void engage(const Pose&) noexcept override { ++stylus_.engaged; }
    DeviceLimits limits() const noexcept override { return {.peakForce = 8, .peakTorque = 100, .nominalStiffness = 2}; }

  private:
    Stylus& stylus_;
};

struct Mapped {
    Stylus stylus;
    std::unique_ptr<Device> device;
    double t = 0;
    DeviceReading reading;

    explicit Mapped(const Workspace& workspace = {}, const Pose& X_WT_start = {{100, 200, 300}, Quat::Identity()}) {
        stylus.reading.X_WT_device = {{7, -3, 11}, expRotation(Vec3(0.3, 0.2, 0.1))};
        device = makeMapped(std::make_unique<StylusDevice>(stylus), X_WT_start);
        device->control()->setWorkspace(workspace);
        tick();
    }
    const Pose& tick(int times = 1) {
        for (int i = 0; i < times; ++i, t += 1) reading = device->read(t, 1);
        return reading.X_WT_device;
    }
    void set(const std::function<void(Workspace&)>& change) {
        Workspace workspace = device->control()->workspace();
        change(workspace);
        device->control()->setWorkspace(workspace);
    }
    Wrench feel(const Wrench& wrench) {
        device->write(wrench);
        return stylus.felt;
    }
    Pose& hand() { return stylus.reading.X_WT_device; }
};

bool near(const Pose& a, const Pose& b) { return (a.p - b.p).norm() < 1e-9 && a.q.angularDistance(b.q) < 1e-9; }

Workspace turned(double scale) {
    Workspace workspace;
    workspace.scale = scale;
    workspace.q_WD = expRotation(Vec3(0, std::numbers::pi / 2, 0));  // the device's x is the scene's -z
    return workspace;
}

}  // namespace

TEST_CASE("workspace: the pose of the hand at the start of a run maps to the tool's start", "[device]") {
    Mapped mapped(turned(3));
    CHECK(near(mapped.reading.X_WT_device, {{100, 200, 300}, Quat::Identity()}));
    CHECK(mapped.stylus.engaged == 1);
}

TEST_CASE("workspace: translations are scaled and rotated, rotations are only rotated", "[device]") {
    Mapped mapped(turned(3));
    mapped.hand().p += Vec3(1, 2, 0);
    mapped.hand().q = expRotation(Vec3(0.4, 0, 0)) * mapped.hand().q;  // about the device's x
    CHECK(near(mapped.tick(), {{100, 206, 297}, expRotation(Vec3(0, 0, -0.4))}));
}

TEST_CASE("workspace: the wrench returns along the device's axes", "[device]") {
    Mapped mapped(turned(2));
    const Wrench felt = mapped.feel({{0, 0, -6}, {0, 4, 0}});
    CHECK((felt.force - Vec3(3, 0, 0)).norm() < 1e-12);
    CHECK((felt.torque - Vec3(0, 1, 0)).norm() < 1e-12);
    const DeviceLimits limits = mapped.device->limits();
    CHECK(limits.peakForce == 16);  // in the scene, so that 8 N reach the hand
    CHECK(limits.peakTorque == 400);
    CHECK(limits.nominalStiffness == 2);
}

TEST_CASE("workspace: the hand feels the gains as set, and the mapping creates no energy", "[device]") {
    const double scale = GENERATE(0.2, 1.0, 5.0);
    Mapped mapped(turned(scale));
    const double k = 0.7, kr = torsionInScene(400, scale);
    const Vec3 lever(20, -10, 5);  // the springs act about a point away from the tool's origin
    const Pose X0 = mapped.reading.X_WT_device;
    // The scene's wrench on the hand at its pose: springs between tool and hand, with the tool held at X0.
    const auto feel = [&](const Pose& hand) {
        mapped.hand() = hand;
        const Pose X = mapped.tick();
        const Vec3 force = k * (X0 * lever - X * lever);
        const Vec3 torque = -kr * logRotation(X.q * X0.q.conjugate());
        return mapped.feel({force, torque + (X.q * lever).cross(force)});
    };
    const Pose hand = mapped.hand();
    const double h = 1e-5;
    Eigen::Matrix<double, 6, 6> K;
    for (int i = 0; i < 6; ++i) {
        Vec6 x = Vec6::Zero();
        x[i] = h;
        const Wrench more = feel(moved(hand, x)), less = feel(moved(hand, -x));
        K.col(i) << (more.force - less.force) / (2 * h), (more.torque - less.torque) / (2 * h);
    }
    CHECK((K.topLeftCorner<3, 3>() + k * Mat3::Identity()).norm() < 1e-6);
    // A symmetric matrix: the wrench is the gradient of an energy, so no closed path gives work. The lever is divided
    // by the scale.
    CHECK((K - K.transpose()).norm() < 1e-5 * K.norm());
    const Vec3 own = turned(scale).q_WD.conjugate() * lever / scale;
    const Mat3 ofLever = k * (own.squaredNorm() * Mat3::Identity() - own * own.transpose());
    CHECK((K.bottomRightCorner<3, 3>() + 400 * Mat3::Identity() + ofLever).norm() < 1e-4 * K.norm());
}

TEST_CASE("workspace: engaging maps the hand to the tool and does not move the tool", "[device]") {
    Mapped mapped;
    mapped.hand().p += Vec3(50, 0, 0);
    mapped.tick();
    const Pose free{{110, 190, 300}, expRotation(Vec3(0, 0, 1))};
    mapped.device->engage(free);
    CHECK(mapped.stylus.engaged == 2);
    CHECK(near(mapped.tick(), free));
    mapped.hand().p.x() += 1;
    CHECK((mapped.tick().p - free.p - Vec3(1, 0, 0)).norm() < 1e-9);
}

TEST_CASE("workspace: while the clutch is held only the hand moves, and no force jumps", "[device]") {
    Mapped mapped(turned(2));
    const Wrench wrench{.force = {10, 0, 0}};
    mapped.feel(wrench);
    const Pose before = mapped.tick();
    double last = mapped.feel(wrench).force.norm(), steepest = 0;
    REQUIRE(last == Approx(5));
    const auto go = [&](int ticks) {
        for (int i = 0; i < ticks; ++i) {
            mapped.hand().p += Vec3(0.1, 0.2, 0);
            mapped.tick();
            const double now = mapped.feel(wrench).force.norm();
            steepest = std::max(steepest, std::abs(now - last));
            last = now;
        }
    };
    mapped.stylus.reading.buttons = 2;
    go(100);
    CHECK(near(mapped.reading.X_WT_device, before));
    CHECK(last == 0);
    mapped.stylus.reading.buttons = 1;  // other buttons are not the clutch
    const Pose released = mapped.tick();
    CHECK(near(released, before));
    last = mapped.feel(wrench).force.norm();
    go(150);
    CHECK(last == Approx(5));
    CHECK(steepest <= 5.0 / 50 + 1e-9);
    CHECK((mapped.reading.X_WT_device.p - before.p - 150 * 2 * Vec3(0, 0.2, -0.1)).norm() < 1e-9);
}

TEST_CASE("workspace: new axes and a lost reading move nothing", "[device]") {
    Mapped mapped;
    mapped.hand().p += Vec3(5, 5, 5);
    const Pose before = mapped.tick();
    mapped.set([](Workspace& w) { w.q_WD = expRotation(Vec3(1, 0, 0)); });
    CHECK(near(mapped.tick(), before));

    const bool fault = GENERATE(true, false);
    (fault ? mapped.stylus.reading.fault : mapped.stylus.reading.valid) = fault;
    mapped.hand().p = {400, 0, 0};
    CHECK(near(mapped.tick(), before));
    CHECK(mapped.reading.fault == fault);
    CHECK(mapped.reading.valid == fault);
    mapped.stylus.reading.fault = false;
    mapped.stylus.reading.valid = true;
    CHECK(near(mapped.tick(), before));
}

TEST_CASE("workspace: the tool glides to a new offset, and a new scale waits for the next run of the device",
          "[device]") {
    Mapped mapped;
    mapped.set([](Workspace& w) {
        w.offset = {0, 10, 0};
        w.scale = 7;
    });
    Vec3 last = mapped.reading.X_WT_device.p;
    for (int i = 0; i < 250; ++i) {
        const Vec3 p = mapped.tick().p;
        REQUIRE((p - last).norm() <= 0.05 + 1e-9);  // mm per tick
        last = p;
    }
    CHECK((last - Vec3(100, 210, 300)).norm() < 1e-9);
    mapped.hand().p.x() += 1;
    CHECK((mapped.tick().p - Vec3(101, 210, 300)).norm() < 1e-9);
    // The offset is relative to the start, not to each engagement.
    mapped.device->engage(mapped.reading.X_WT_device);
    CHECK((mapped.tick(10).p - Vec3(101, 210, 300)).norm() < 1e-9);
}

TEST_CASE("workspace: invalid values are refused with one sentence", "[device]") {
    CHECK(checkWorkspace({}).empty());
    Workspace workspace;
    workspace.scale = GENERATE(0.0, -1.0, NAN, 1e9);
    CHECK_THAT(checkWorkspace(workspace), Catch::Contains("scale"));
    workspace = {};
    workspace.offset.x() = INFINITY;
    CHECK_THAT(checkWorkspace(workspace), Catch::Contains("offset"));
    workspace = {};
    workspace.q_WD.coeffs().setZero();
    CHECK_THAT(checkWorkspace(workspace), Catch::Contains("axes"));
}

}  // namespace touchstone::workspace_tests
