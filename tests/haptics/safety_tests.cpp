#include "haptics/device/safety.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "haptics/loop/step.hpp"

using namespace touchstone;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
// A clamp takes a length, a quotient and a product: a few roundings of half an ulp.

double length(const Vec3& v) { return std::hypot(v.x(), v.y(), v.z()); }

}  // namespace

TEST_CASE("safety: what is within the limits passes unchanged", "[safety]") {
    SafetyStage safety({.peakForce = 22, .peakTorque = 170});
    const Wrench in{{3, -4, 12}, {100, -50, 25}};
    const Wrench out = safety.pass({.wrench_o = in});
    CHECK(out.force == in.force);
    CHECK(out.torque == in.torque);
    for (const TripCount& count : safety.counts()) CHECK(count.ticks == 0);
    CHECK_FALSE(safety.zeroed());
}

TEST_CASE("safety: force and torque are clamped by magnitude with their direction kept", "[safety]") {
    SafetyStage safety({.peakForce = 26, .peakTorque = 100});
    const Wrench out = safety.pass({.wrench_o = {{6, -8, 24}, {0, 300, -400}}});  // |F| 26, |T| 500
    CHECK(out.force == Vec3(6, -8, 24));                                          // at the limit is within it
    CHECK((out.torque - Vec3(0, 60, -80)).norm() < 1e-12);
    CHECK(safety.active(Trip::TorqueClamped));
    CHECK_FALSE(safety.active(Trip::ForceClamped));
    const Wrench huge = safety.pass({.wrench_o = {{3e300, 0, -4e300}, {0, 0, 0}}});
    CHECK((huge.force - Vec3(15.6, 0, -20.8)).norm() < 1e-12);
    CHECK_FALSE(safety.zeroed());
}

TEST_CASE("safety: every failure zeroes the wrench, by its own name", "[safety]") {
    const Wrench good{{1, 2, 3}, {4, 5, 6}};
    struct Case {
        SafetyInput input;
        Trip trip;
    };
    const Case cases[] = {
        {{.wrench_o = {{kNan, 0, 0}, {0, 0, 0}}}, Trip::NotFinite},
        {{.wrench_o = {{0, 0, 0}, {0, kInf, 0}}}, Trip::NotFinite},
        {{.wrench_o = good, .flags = kNonFinite}, Trip::SolverFailed},
        {{.wrench_o = good, .flags = kBadInput | kCapped}, Trip::BadInput},
        {{.wrench_o = good, .flags = kListOverflow}, Trip::ListOverflow},
        {{.wrench_o = good, .fresh = false}, Trip::StaleReading},
    };
    for (const auto& [input, trip] : cases) {
        INFO(name(trip));
        SafetyStage safety({});
        const Wrench out = safety.pass(input);
        CHECK(out.force == Vec3::Zero());
        CHECK(out.torque == Vec3::Zero());
        CHECK(safety.zeroed());
        for (int i = 0; i < kTripCount; ++i) CHECK(safety.count(Trip(i)).ticks == (Trip(i) == trip ? 1u : 0u));
    }
}

TEST_CASE("safety: flags of a tick that still has an answer let its force through", "[safety]") {
    SafetyStage safety({});
    const std::uint32_t harmless =
        kInfeasible | kNotDeeper | kIterationLimit | kRowsTruncated | kCapped | kHalved | kUnfinished | kProjected;
    CHECK(safety.pass({.wrench_o = {{1, 0, 0}, {0, 0, 0}}, .flags = harmless}).force.x() == 1);
}

TEST_CASE("safety: events count beginnings, ticks count every tick", "[safety]") {
    SafetyStage safety({.peakForce = 10, .peakTorque = 10});
    const std::vector<double> forces{5, 20, 20, 5, 20, 5, 5, 20, 20, 20};
    for (const double f : forces) safety.pass({.wrench_o = {{f, 0, 0}, {0, 0, 0}}});
    CHECK(safety.count(Trip::ForceClamped).events == 3);
    CHECK(safety.count(Trip::ForceClamped).ticks == 6);
    CHECK(safety.count(Trip::TorqueClamped).ticks == 0);
}

TEST_CASE("safety: the fade scales what the clamp let through", "[safety]") {
    SafetyStage safety({.peakForce = 10, .peakTorque = 100});
    const Wrench in{{40, 0, 0}, {0, 8, 0}};
    CHECK(safety.pass({.wrench_o = in, .fade = 0.25}).force.x() == Approx(2.5));
    CHECK(safety.pass({.wrench_o = in, .fade = 0.25}).torque.y() == Approx(2));
    CHECK(safety.pass({.wrench_o = in, .fade = 0}).force == Vec3::Zero());
    CHECK_FALSE(safety.zeroed());
    CHECK(safety.pass({.wrench_o = in, .fade = 7}).force.x() == Approx(10));
    CHECK(safety.pass({.wrench_o = in, .fade = -1}).force == Vec3::Zero());
    CHECK(safety.pass({.wrench_o = in, .fade = kNan}).force == Vec3::Zero());
}

TEST_CASE("safety: a limit that is no limit lets nothing through", "[safety]") {
    for (const double limit : {kNan, -1.0, 0.0}) {
        SafetyStage safety({.peakForce = limit, .peakTorque = limit});
        const Wrench out = safety.pass({.wrench_o = {{1, 2, 3}, {4, 5, 6}}});
        CHECK(out.force == Vec3::Zero());
        CHECK(out.torque == Vec3::Zero());
    }
}

TEST_CASE("safety: any bits in, a finite wrench within the limits out", "[safety]") {
    const std::uint64_t seed = std::random_device{}();
    INFO("seed " << seed);
    std::mt19937_64 random(seed);
    const double special[] = {kNan, kInf, -kInf, 1e300, -1e300, 1.7e308, -1.7e308, 5e-324, 0.0, -0.0, 22.0, 1.0};
    const auto any = [&] {
        switch (random() % 4) {
            case 0:
                return special[random() % std::size(special)];
            case 1:
                return std::bit_cast<double>(random());
            default:
                return std::uniform_real_distribution<double>(-300, 300)(random);
        }
    };
    bool good = true;
    int passed = 0;
    for (int i = 0; i < 200'000; ++i) {
        const DeviceLimits limits{.peakForce = std::abs(any()), .peakTorque = std::abs(any())};
        SafetyStage safety(limits);
        SafetyInput input{.wrench_o = {{any(), any(), any()}, {any(), any(), any()}}, .fade = any()};
        if (random() % 8 == 0) input.flags = static_cast<std::uint32_t>(random());
        input.fresh = random() % 16 != 0;
        const Wrench out = safety.pass(input);
        const double force = std::isnan(limits.peakForce) ? 0 : limits.peakForce;
        const double torque = std::isnan(limits.peakTorque) ? 0 : limits.peakTorque;
        good &= out.isFinite() && length(out.force) <= force + 1e-320 && length(out.torque) <= torque + 1e-320;
        passed += length(out.force) > 0;
        if (!good) FAIL("input " << input.wrench_o.force.transpose() << ", limits " << limits.peakForce);
    }
    CHECK(passed > 10'000);  // the test sees forces, not only zeros
}
