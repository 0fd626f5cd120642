#pragma once
// The safety matrix of a haptic arm: what every driver must do in each fault, whatever the arm. A driver's tests give
// it a stand-in of the arm and the names of the faults.
#include <catch2/catch.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "haptics/device/control.hpp"

namespace touchstone::test {

/// Calls `step` every millisecond until it returns true; false after half a minute, which only a hang exceeds.
inline bool within(const std::function<bool()>& step) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (std::chrono::steady_clock::now() < end) {
        if (step()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

/// Ticks a device: reads, then writes a wrench. The first tick begins the run, which engages the device.
struct Ticked {
    std::unique_ptr<Device> device;
    double t = 0;
    DeviceReading reading;
    Wrench wrench;

    explicit Ticked(std::unique_ptr<Device> its) : device(std::move(its)) {}
    void tick() {
        reading = device->read(t, 1);
        t += 1;
        device->write(wrench);
    }
    bool until(const std::function<bool()>& done) {
        return within([&] {
            tick();
            return done();
        });
    }
    void tickFor(int ticks) {
        for (int i = 0; i < ticks; ++i) {
            tick();
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    }
    /// Whether every reading so far was good. After a bad one, which a busy machine may cause, the tool is taken up at
    /// an offset.
    bool undisturbed() const {
        return reading.valid && !reading.fault && status().state == DeviceStatus::State::Running;
    }
    DeviceStatus status() const { return device->control()->status(); }
};

/// The stand-in of an arm, as the matrix sees it.
class ArmStandIn {
  public:
    virtual ~ArmStandIn() = default;
    /// Opens the driver. Options are comma-separated; `stale=500` because a busy machine delays threads.
    virtual std::unique_ptr<Device> open(const std::string& options = {}) = 0;
    virtual Vec3 force() const = 0;   ///< of the motors, N
    virtual Vec3 torque() const = 0;  ///< mN·m
    virtual bool hasTorque() const { return true; }
    virtual void hand(const Vec3& p) = 0;  ///< rest position of the hand, mm
    virtual Vec3 position() const = 0;     ///< of the hand-held part, mm
    virtual void inject(const std::string& fault) = 0;
    virtual void clear() = 0;  ///< ends the faults

    Wrench push() const { return {{0, 2, 0}, hasTorque() ? Vec3(0, 0, 20) : Vec3(0, 0, 0)}; }
    bool pushes() const { return force() == push().force && torque() == push().torque; }
    bool rests() const { return force().isZero(0) && torque().isZero(0); }
};

inline std::string refusalOf(ArmStandIn& arm, const std::string& options) {
    try {
        arm.open(options);
    } catch (const std::runtime_error& e) {
        return e.what();
    }
    return {};
}

/// A fault that passes: zero force, named, and a force again only after engaging. `atOnce`: the fault and the zero
/// force come in the same exchange.
inline void checkFault(ArmStandIn& arm, const std::string& fault, const std::string& words, bool atOnce = false,
                       const std::string& options = {}) {
    INFO(fault);
    Ticked ticked(arm.open(options));
    ticked.wrench = arm.push();
    REQUIRE(ticked.until([&] { return arm.pushes(); }));

    arm.inject(fault);
    REQUIRE(ticked.until([&] { return ticked.reading.fault; }));
    if (!atOnce) REQUIRE(ticked.until([&] { return arm.rests(); }));
    CHECK(arm.rests());
    CHECK(ticked.status().state == DeviceStatus::State::Fault);
    CHECK_THAT(ticked.status().text, Catch::Contains(words));
    // The fault passes while a wrench is still requested: the force returns only after engaging.
    arm.clear();
    REQUIRE(ticked.until([&] { return !ticked.reading.fault && ticked.reading.valid; }));
    ticked.tickFor(50);
    CHECK(arm.rests());
    CHECK(ticked.status().state == DeviceStatus::State::Fault);
    ticked.device->engage(ticked.reading.X_WT_device);
    CHECK(ticked.until([&] { return arm.pushes(); }));
    CHECK(ticked.status().state == DeviceStatus::State::Running);
    CHECK_THAT(ticked.status().details, Catch::Contains(words));
}

/// The arm is lost: zero force, named, not engaged while it is lost; the driver can be opened again only by
/// reconnecting.
inline void checkLost(ArmStandIn& arm, Ticked& ticked, const std::string& fault, const std::string& words,
                      const std::string& options) {
    INFO(fault);
    ticked.wrench = arm.push();
    REQUIRE(ticked.until([&] { return arm.pushes(); }));
    arm.hand({5, 0, 0});
    REQUIRE(ticked.until([&] { return arm.position().x() > 4; }));

    arm.inject(fault);
    REQUIRE(ticked.until([&] { return ticked.reading.fault; }));
    CHECK_FALSE(ticked.reading.valid);
    CHECK(ticked.until([&] { return arm.rests(); }));
    CHECK(ticked.status().state == DeviceStatus::State::Lost);
    CHECK_THAT(ticked.status().text, Catch::Contains(words));
    ticked.device->engage(ticked.reading.X_WT_device);  // cannot engage a lost device
    ticked.tickFor(20);
    CHECK(arm.rests());
    CHECK_THAT(refusalOf(arm, options), Catch::Contains("lost") && Catch::Contains("reconnect"));
}

/// Reconnects a lost arm that is there again: the tool stays where it is, without force until it is engaged.
inline void checkReconnects(ArmStandIn& arm, Ticked& ticked) {
    const Pose before = ticked.reading.X_WT_device;
    arm.clear();
    ticked.device->control()->reconnect();
    REQUIRE(ticked.until([&] { return ticked.reading.valid && !ticked.reading.fault; }));
    CHECK((ticked.reading.X_WT_device.p - before.p).norm() < 0.5);  // the stylus may be elsewhere, the tool is not
    CHECK(arm.rests());
    ticked.device->engage(ticked.reading.X_WT_device);
    CHECK(ticked.until([&] { return arm.pushes(); }));
    CHECK(ticked.until([&] { return ticked.status().state == DeviceStatus::State::Running; }));
}

/// A wrench that no tick renews drops to zero.
inline void checkUnrenewed(ArmStandIn& arm) {
    Ticked ticked(arm.open());
    ticked.wrench = arm.push();
    REQUIRE(ticked.until([&] { return arm.pushes(); }));
    CHECK(within([&] { return arm.rests(); }));
}

/// The output is finite and within the limits.
inline void checkLimits(ArmStandIn& arm) {
    Ticked ticked(arm.open());
    const DeviceLimits limits = ticked.device->limits();
    ticked.wrench = {{300, 400, 0}, {0, 0, 1e9}};
    CHECK(ticked.until([&] { return arm.force().norm() > 0; }));
    CHECK((arm.force() - limits.peakForce * Vec3(0.6, 0.8, 0)).norm() < 1e-9);
    CHECK((arm.torque() - (arm.hasTorque() ? Vec3(0, 0, limits.peakTorque) : Vec3(0, 0, 0))).norm() < 1e-9);
    ticked.wrench.force.x() = NAN;
    CHECK(ticked.until([&] { return arm.rests(); }));
}

}  // namespace touchstone::test
