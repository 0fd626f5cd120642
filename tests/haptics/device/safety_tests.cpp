#include "haptics/device/safety.hpp"

#include <algorithm>
#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "haptics/loop/step.hpp"

namespace touchstone::safety_tests {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

double length(const Vec3& v) { return std::hypot(v.x(), v.y(), v.z()); }

/// Limits with only the peaks active.
DeviceLimits peaks(double force, double torque) {
    return {.peakForce = force, .peakTorque = torque, .slewForce = 1e6, .slewTorque = 1e6, .motors = false};
}

SafetyInput along(double x) { return {.wrench_o = {{x, 0, 0}, {0, 0, 0}}}; }

/// A stage with motors that passes the force.
SafetyStage engaged(const DeviceLimits& limits = {}) {
    SafetyStage safety(limits);
    safety.engage();
    safety.pass({});
    REQUIRE(safety.engagement() == Engagement::Engaged);
    return safety;
}

/// Ticks until the stage faults, or `ticks` if it does not.
int ticksUntilFault(SafetyStage& safety, int ticks, const auto& forceAt) {
    for (int i = 0; i < ticks; ++i) {
        safety.pass(along(forceAt(i)));
        if (safety.engagement() == Engagement::Faulted) return i;
    }
    return ticks;
}

}  // namespace

TEST_CASE("safety: a wrench within the limits passes unchanged", "[safety]") {
    SafetyStage safety(peaks(22, 170));
    const Wrench in{{3, -4, 12}, {100, -50, 25}};
    const Wrench out = safety.pass({.wrench_o = in});
    CHECK(out.force == in.force);
    CHECK(out.torque == in.torque);
    for (const TripCount& count : safety.counts()) CHECK(count.ticks == 0);
    CHECK_FALSE(safety.zeroed());
}

TEST_CASE("safety: force and torque are clamped by magnitude with their direction kept", "[safety]") {
    SafetyStage safety(peaks(26, 100));
    const Wrench out = safety.pass({.wrench_o = {{6, -8, 24}, {0, 300, -400}}});  // |F| 26, |T| 500
    CHECK(out.force == Vec3(6, -8, 24));                                          // a force at the limit is within it
    CHECK((out.torque - Vec3(0, 60, -80)).norm() < 1e-12);
    CHECK(safety.active(Trip::TorqueClamped));
    CHECK_FALSE(safety.active(Trip::ForceClamped));
    const Wrench huge = safety.pass({.wrench_o = {{3e300, 0, -4e300}, {0, 0, 0}}});
    CHECK((huge.force - Vec3(15.6, 0, -20.8)).norm() < 1e-12);
    CHECK_FALSE(safety.zeroed());
}

TEST_CASE("safety: a device without torque gets none, and none is limited, waited for or an overload", "[safety]") {
    SafetyStage safety{DeviceLimits{.torque = false}};
    safety.engage();
    const SafetyInput in{.wrench_o = {{1, 0, 0}, {0, 1000, 0}}};
    for (int i = 0; i < 6000; ++i) {
        const Wrench out = safety.pass(in);
        REQUIRE(out.torque == Vec3(0, 0, 0));
        REQUIRE(safety.engagement() != Engagement::Faulted);
    }
    CHECK(safety.pass(in).force == Vec3(1, 0, 0));
    for (const Trip trip : {Trip::TorqueClamped, Trip::TorqueThermallyLimited, Trip::TorqueSlewLimited, Trip::Overload})
        CHECK(safety.count(trip).ticks == 0);
    SafetyStage with{DeviceLimits{}};
    with.engage();
    CHECK(with.pass(in).force == Vec3(0, 0, 0));  // it waits for a small torque
}

TEST_CASE("safety: every failure zeroes the wrench under its own name", "[safety]") {
    const Wrench good{{1, 2, 3}, {4, 5, 6}};
    struct Case {
        SafetyInput input;
        Trip trip;
    };
    const Case cases[] = {
        {{.wrench_o = {{kNan, 0, 0}, {0, 0, 0}}}, Trip::NotFinite},
        {{.wrench_o = {{0, 0, 0}, {0, kInf, 0}}}, Trip::NotFinite},
        {{.wrench_o = good, .solverFailed = true}, Trip::SolverFailed},
        {{.wrench_o = good, .badInput = true}, Trip::BadInput},
        {{.wrench_o = good, .listOverflow = true}, Trip::ListOverflow},
        {{.wrench_o = good, .fault = true}, Trip::DeviceFault},
        {{.wrench_o = good, .fresh = false}, Trip::StaleReading},
        {{.wrench_o = good, .period = 10.1}, Trip::LateTick},
        {{.wrench_o = good, .hung = true}, Trip::TickHung},
    };
    for (const auto& [input, trip] : cases) {
        INFO(name(trip));
        SafetyStage safety = engaged();
        CHECK(safety.pass({.wrench_o = good}).force.x() > 0);
        const Wrench out = safety.pass(input);
        CHECK(out.force == Vec3::Zero());
        CHECK(out.torque == Vec3::Zero());
        CHECK(safety.zeroed());
        CHECK(safety.acting() == bit(trip));
        for (int i = 0; i < kTripCount; ++i)
            if (info(Trip(i)).follows != Follows::Limit)
                CHECK(safety.count(Trip(i)).ticks == (Trip(i) == trip ? 1u : 0u));

        // The effect is that of the table.
        const bool fault = info(trip).follows == Follows::Fault;
        CHECK(safety.engagement() == (fault ? Engagement::Faulted : Engagement::Engaging));
        if (fault) CHECK(safety.cause() == trip);
        for (int i = 0; i < 1000; ++i) safety.pass({});
        safety.stop();  // does not clear a fault
        CHECK(safety.engagement() == (fault ? Engagement::Faulted : Engagement::Stopped));
        CHECK(safety.pass({.wrench_o = good}).force == Vec3::Zero());
        safety.engage();
        safety.pass({});
        CHECK(safety.pass({.wrench_o = good}).force.x() > 0);
    }
}

TEST_CASE("safety: events count beginnings, ticks count every tick", "[safety]") {
    SafetyStage safety(peaks(10, 10));
    const std::vector<double> forces{5, 20, 20, 5, 20, 5, 5, 20, 20, 20};
    for (const double f : forces) safety.pass({.wrench_o = {{f, 0, 0}, {0, 0, 0}}});
    CHECK(safety.count(Trip::ForceClamped).events == 3);
    CHECK(safety.count(Trip::ForceClamped).ticks == 6);
    CHECK(safety.count(Trip::TorqueClamped).ticks == 0);
}

TEST_CASE("safety: the fade scales the clamped wrench", "[safety]") {
    SafetyStage safety(peaks(10, 100));
    const Wrench in{{40, 0, 0}, {0, 8, 0}};
    CHECK(safety.pass({.wrench_o = in, .fade = 0.25}).force.x() == Approx(2.5));
    CHECK(safety.pass({.wrench_o = in, .fade = 0.25}).torque.y() == Approx(2));
    CHECK(safety.pass({.wrench_o = in, .fade = 0}).force == Vec3::Zero());
    CHECK_FALSE(safety.zeroed());
    CHECK(safety.pass({.wrench_o = in, .fade = 7}).force.x() == Approx(10));
    CHECK(safety.pass({.wrench_o = in, .fade = -1}).force == Vec3::Zero());
    CHECK(safety.pass({.wrench_o = in, .fade = kNan}).force == Vec3::Zero());
}

TEST_CASE("safety: an invalid limit passes nothing", "[safety]") {
    for (const double limit : {kNan, -1.0, 0.0}) {
        SafetyStage safety(peaks(limit, limit));
        const Wrench out = safety.pass({.wrench_o = {{1, 2, 3}, {4, 5, 6}}});
        CHECK(out.force == Vec3::Zero());
        CHECK(out.torque == Vec3::Zero());
    }
}

TEST_CASE("safety: every trip has a unique name and a sentence", "[safety]") {
    std::vector<std::string> names;
    for (int i = 0; i < kTripCount; ++i) {
        names.emplace_back(name(Trip(i)));
        CHECK(std::string(info(Trip(i)).why).back() == '.');
    }
    std::sort(names.begin(), names.end());
    CHECK(std::unique(names.begin(), names.end()) == names.end());
}

TEST_CASE("safety: a device with motors begins stopped, and engages once the requested force is small", "[safety]") {
    SafetyStage safety{DeviceLimits{}};
    CHECK(safety.engagement() == Engagement::Stopped);
    CHECK(safety.pass(along(0.5)).force.x() == 0);
    safety.engage();
    for (int i = 0; i < 10; ++i) {
        CHECK(safety.pass(along(1.2)).force.x() == 0);  // a twentieth of 22 N is 1.1
        CHECK(safety.pass({.wrench_o = {{0, 0, 0}, {0, 8.6, 0}}}).torque.y() == 0);
        CHECK(safety.engagement() == Engagement::Engaging);
        CHECK(safety.zeroed());
    }
    SafetyInput fading = along(1.0);
    fading.fade = 0.5;
    CHECK(safety.pass(fading).force.x() == 0.5);
    CHECK(safety.engagement() == Engagement::Engaging);
    CHECK(safety.pass(along(2)).force.x() == 2);  // the small force is required only at the beginning
    CHECK(safety.engagement() == Engagement::Engaged);

    safety.stop();
    CHECK(safety.pass(along(2)).force.x() == 0);
    CHECK(safety.engagement() == Engagement::Stopped);
    safety.engage();
    CHECK(safety.pass(along(2)).force.x() == 0);
    safety.pass(along(0));
    CHECK(safety.pass(along(2)).force.x() == 2);
    safety.begin();
    CHECK(safety.engagement() == Engagement::Stopped);
}

TEST_CASE("safety: a device without motors is engaged from the start, and cannot heat, buzz or be late", "[safety]") {
    SafetyStage safety({.motors = false});
    CHECK(safety.pass(along(2)).force.x() == 2);
    CHECK(safety.engagement() == Engagement::Engaged);
    SafetyInput late = along(2);
    late.period = 1000;
    CHECK(safety.pass(late).force.x() == 2);
    const auto hard = [](int i) { return i % 4 < 2 ? 30.0 : 10.0; };
    CHECK(ticksUntilFault(safety, 20'000, hard) == 20'000);
    for (int i = 0; i < 8; ++i) safety.pass(along(30));
    CHECK(safety.pass(along(30)).force.x() == Approx(22));
    CHECK(safety.count(Trip::ForceThermallyLimited).ticks == 0);
}

TEST_CASE("safety: growth and turns of the wrench are slew-rate limited, a fall is not", "[safety]") {
    SafetyStage safety = engaged({.slewForce = 2, .slewTorque = 30});
    CHECK(safety.pass(along(5)).force.x() == Approx(2));
    CHECK(safety.active(Trip::ForceSlewLimited));
    CHECK_FALSE(safety.active(Trip::TorqueSlewLimited));
    CHECK(safety.pass(along(5)).force.x() == Approx(4));
    CHECK(safety.pass(along(5)).force.x() == 5);
    CHECK_FALSE(safety.active(Trip::ForceSlewLimited));
    CHECK(safety.pass(along(0.5)).force.x() == 0.5);  // down at once
    safety.pass(along(2));
    CHECK(safety.pass(along(-9)).force.x() == Approx(-2));  // a reversal passes zero at once, then grows
    safety.pass(along(-4));
    // A turn by a right angle: the old component may vanish at once, the new one grows.
    const Wrench turned = safety.pass({.wrench_o = {{0, 4, 0}, {0, 0, 50}}});
    CHECK((turned.force - Vec3(0, 2, 0)).norm() < 1e-12);
    CHECK(turned.torque.z() == Approx(30));
    CHECK(safety.active(Trip::TorqueSlewLimited));
    // With half the tick period, half the growth.
    CHECK(safety.pass({.wrench_o = {{0, 9, 0}, {0, 0, 0}}, .dt = 0.5}).force.y() == Approx(3));
}

TEST_CASE("safety: a lasting force falls smoothly to the continuous limit", "[safety]") {
    const double tau = SafetyStage::kThermalMs;
    for (const double wanted : {2.9, 5.0, 22.0}) {
        SafetyStage safety = engaged();
        double before = 0, square = 0, steepest = 0;
        int whole = 0;  // ticks until the thermal limit acts
        for (int i = 0; i < 4 * tau; ++i) {
            const double f = safety.pass(along(std::min(wanted, 22.0))).force.x();
            if (i > 20) steepest = std::max(steepest, before - f);
            if (!safety.active(Trip::ForceThermallyLimited) && whole == i) whole = i + 1;
            square += (f * f - square) / tau;
            REQUIRE(square < 9 + 0.01);  // another first-order formula: it differs by one tick
            before = f;
        }
        INFO(wanted << " N");
        CHECK(before == Approx(std::min(wanted, 3.0)).epsilon(0.01));
        CHECK(steepest < 0.2);  // N/ms
        // The square of the limit falls linearly from 22² at half the heat to 3² at full heat.
        const double wanted2 = wanted * wanted, heat = 1 - (wanted2 - 9) / (2 * (22 * 22 - 9));
        if (wanted > 4) CHECK(whole == Approx(-tau * std::log(1 - heat * 9 / wanted2)).margin(25));
        if (wanted < 3) CHECK(whole == 4 * tau);
        // Another scene does not cool the motors.
        SafetyStage next{DeviceLimits{}};
        next.inherit(safety);
        next.engage();
        next.pass({});
        for (int i = 0; i < 20; ++i) before = next.pass(along(22)).force.x();
        CHECK((before < 4) == (wanted > 4));
    }
}

TEST_CASE("safety: a device without a fresh reading for 100 ms is lost", "[safety]") {
    SafetyStage safety = engaged();
    for (int i = 0; i < 5; ++i) {
        for (int ms = 0; ms < 100; ++ms) safety.pass({.wrench_o = {}, .fresh = false});
        CHECK(safety.engagement() == Engagement::Engaging);
        safety.pass({});
    }
    for (int ms = 0; ms < 101; ++ms) safety.pass({.wrench_o = {}, .fresh = false});
    CHECK(safety.engagement() == Engagement::Faulted);
    CHECK(safety.cause() == Trip::DeviceLost);
}

TEST_CASE("safety: pressing beyond the peak for 5 s is a fault, for less it is not", "[safety]") {
    SafetyStage safety = engaged();
    const auto pressed = [](int i) { return i == 4990 ? 21.0 : 30.0; };
    CHECK(ticksUntilFault(safety, 20'000, pressed) == 4990 + 5001);
    CHECK(safety.cause() == Trip::Overload);
    safety.engage();
    safety.pass({});
    CHECK(ticksUntilFault(safety, 5000, [](int) { return 30.0; }) == 5000);
}

TEST_CASE("safety: a buzz is a fault, a hand's motion and a rough surface are not", "[safety]") {
    const auto sine = [](double hertz, double mean, double amplitude) {
        return [=](int i) { return mean + amplitude * std::sin(2 * M_PI * hertz * i / 1000); };
    };
    const auto ticks = [&](double hertz, double mean, double amplitude) {
        SafetyStage safety = engaged();
        const int n = ticksUntilFault(safety, 3000, sine(hertz, mean, amplitude));
        if (n < 3000) CHECK(safety.cause() == Trip::Buzz);
        return n;
    };
    CHECK(ticks(200, 5, 3) < 30);
    CHECK(ticks(60, 5, 3) < 200);
    CHECK(ticks(450, 0, 8) < 30);
    CHECK(ticks(30, 5, 3) == 3000);   // a single jerk is no fault
    CHECK(ticks(12, 5, 5) == 3000);   // the fastest tremor of a hand
    CHECK(ticks(200, 5, 1) == 3000);  // ripple of 2 N
    // Torque counts as well, on any axis.
    SafetyStage safety = engaged();
    int n = 0;
    while (n < 3000 && safety.engagement() != Engagement::Faulted)
        safety.pass({.wrench_o = {{0, 0, 0}, {0, 0, ++n / 2 % 2 ? 15.0 : -15.0}}});
    CHECK(n < 30);
    safety.engage();
    safety.pass({});
    CHECK(safety.engagement() == Engagement::Engaged);  // the earlier swings are forgotten
}

TEST_CASE("safety: no violation in 1,000,000 arbitrary inputs", "[safety]") {
    const std::uint64_t seed = std::random_device{}();
    std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
    INFO("seed " << seed);
    std::mt19937_64 random(seed);
    const auto chance = [&](unsigned oneOf) { return random() % oneOf == 0; };
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * 0x1p-53 * static_cast<double>(random() >> 11);
    };
    const double special[] = {kNan, kInf, -kInf, 1e300, -1e300, 1.7e308, 5e-324, -5e-324, 1e-310, 0.0, -0.0, 22.0};
    const auto wild = [&] {
        return chance(2) ? special[random() % std::size(special)] : std::bit_cast<double>(random());
    };
    const auto anyLimit = [&](double usual) { return chance(8) ? std::abs(wild()) : usual * uniform(0.1, 3); };

    std::uint64_t inputs = 0, forces = 0, slewed = 0;
    while (inputs < 1'000'000) {
        const DeviceLimits limits{.peakForce = anyLimit(22),
                                  .peakTorque = anyLimit(170),
                                  .continuousForce = anyLimit(3),
                                  .continuousTorque = anyLimit(48),
                                  .slewForce = anyLimit(3),
                                  .slewTorque = anyLimit(40),
                                  .motors = !chance(4)};
        SafetyStage safety(limits);
        const bool violent = chance(3);
        const double dt = uniform(0.1, 4), bound = chance(2) ? 0.5 : 30;
        const int lost = static_cast<int>(random() % 4000);  // the device is lost from then on
        Vec3 wanted = Vec3::Zero();
        bool mayPass = !limits.motors;  // derived from the inputs of the stage
        double stale = 0;
        struct {
            double peak, continuous, slew;
            Vec3 last = Vec3::Zero();
            double heat = 0;
        } parts[] = {{limits.peakForce, limits.continuousForce, limits.slewForce},
                     {limits.peakTorque, limits.continuousTorque, limits.slewTorque}};
        for (int i = 0; i < 2000; ++i, ++inputs) {
            if (chance(200)) safety.stop(), mayPass = false;
            if (chance(100)) safety.engage(), mayPass = true;
            wanted += Vec3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)) * bound;
            if (chance(50)) wanted.setZero();
            if (chance(200)) wanted = Vec3(uniform(-99, 99), uniform(-99, 99), uniform(-99, 99));
            SafetyInput input{.wrench_o = {wanted, 7 * wanted}, .fade = chance(9) ? uniform(0, 1) : 1, .dt = dt};
            if (violent && chance(20))
                for (double* x : {&input.wrench_o.force.x(), &input.wrench_o.torque.z(), &input.fade, &input.period})
                    if (chance(2)) *x = wild();
            if (violent)
                for (bool* bad : {&input.solverFailed, &input.badInput, &input.listOverflow}) *bad = chance(200);
            if (violent && chance(200)) input.fault = true;
            if (violent && chance(200)) input.hung = true;
            input.fresh = i < lost && !chance(200);
            const Wrench out = safety.pass(input);

            // The requirements, independent of the implementation of the stage.
            stale = input.fresh ? 0 : stale + dt;
            const bool finite = input.wrench_o.isFinite();
            const bool late = limits.motors && input.period > 10 * dt;
            const bool fault = !finite || input.solverFailed || input.badInput || input.fault || stale > 100;
            if (fault || safety.engagement() == Engagement::Faulted) mayPass = false;
            const bool zero = !mayPass || !input.fresh || late || input.listOverflow;
            bool good = out.isFinite();
            good &= !zero || (out.force.isZero(0) && out.torque.isZero(0));
            for (auto& part : parts) {
                const Vec3& now = &part == parts ? out.force : out.torque;
                const double size = length(now), before = part.last.squaredNorm();
                const double peak = std::isnan(part.peak) ? 0 : part.peak;
                const double slew = std::isnan(part.slew) ? 0 : part.slew * dt;
                good &= size <= peak;
                const Vec3 way = before > 0 ? Vec3(std::clamp(now.dot(part.last) / before, 0.0, 1.0) * part.last)
                                            : Vec3(Vec3::Zero());
                // Rounding of sums and products of numbers this large.
                const double rounding = 16 * std::numeric_limits<double>::epsilon() * (size + length(part.last));
                good &= length(now - way) <= slew + rounding + 1e-300;
                slewed += length(now - way) > 0.99 * slew && slew > 0;
                if (limits.motors && part.continuous > 0) {
                    part.heat +=
                        -std::expm1(-dt / SafetyStage::kThermalMs) * (std::pow(size / part.continuous, 2) - part.heat);
                    good &= part.heat <= 1 + 1e-9;  // 2000 sums of two roundings
                }
                part.last = now;
            }
            forces += !out.force.isZero(0);
            if (!good)
                FAIL("input " << inputs << ": wanted " << input.wrench_o.force.transpose() << ", "
                              << input.wrench_o.torque.transpose() << ", given " << out.force.transpose() << ", "
                              << out.torque.transpose() << ", limits " << limits.peakForce << " " << limits.slewForce
                              << " " << limits.continuousForce << ", dt " << dt);
        }
    }
    // The test must see forces that pass and forces that are limited, not only zeros.
    CHECK(forces > 100'000);
    CHECK(slewed > 20'000);
}

}  // namespace touchstone::safety_tests
