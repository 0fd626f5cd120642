#include "haptics/hands/hand.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

namespace touchstone::hand_tests {

namespace {

/// A hand from the ranges of mass 0.05-0.5 kg, spring 200-1000 N/m, damping 0-10 N·s/m.
HandParameters anyHand(std::mt19937& random) {
    const auto between = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
    return HandParameters::fromTranslation(between(0.05, 0.5), between(0.2, 1), between(0, 10));
}

Vec3 anyVector(std::mt19937& random, double size) {
    std::uniform_real_distribution<double> u(-size, size);
    return {u(random), u(random), u(random)};
}

}  // namespace

TEST_CASE("hand: at rest under a wrench, springs balance it", "[hand]") {
    // Default hand: 0.5 N/mm and 1012.5 mN·m/rad.
    const Pose target{{10, 20, 30}, expRotation({0.1, 0.2, 0.3})};
    Hand hand({}, {});
    const Wrench wrench{{1, -2, 0.5}, {50.625, 0, -101.25}};
    for (int i = 0; i < 2000; ++i) hand.advance(target, wrench, 1);
    // Critical damping decays with e^-70/s: after 2 s only rounding remains.
    CHECK((hand.pose().p - Vec3(12, 16, 31)).norm() < 1e-9);
    CHECK((logRotation(hand.pose().q * target.q.conjugate()) - Vec3(0.05, 0, -0.1)).norm() < 1e-9);
    CHECK(hand.velocity().norm() < 1e-12);
    CHECK(hand.angularVelocity().norm() < 1e-12);
}

TEST_CASE("hand: without damping it oscillates as mass and spring determine, at any tick period", "[hand]") {
    // 0.1 kg on 1 N/mm: sqrt(1000 N/m / 0.1 kg) = 100 rad/s, so 5 mm at t become 5 cos(0.1 t/ms).
    for (const double dt : {0.1, 1.0, 4.0}) {
        Hand hand(HandParameters::fromTranslation(0.1, 1, 0), {{5, 0, 0}, Quat::Identity()});
        const int ticks = static_cast<int>(std::lround(400 / dt));
        for (int i = 1; i <= ticks; ++i) {
            hand.advance({}, {}, dt);
            // The integration is exact, so only rounding accumulates: 4,000 steps of 1e-16 on 5 mm.
            REQUIRE(hand.pose().p.x() == Approx(5 * std::cos(0.1 * dt * i)).margin(1e-10));
        }
        CHECK(hand.energy({}) == Approx(0.5 * 1 * 25).epsilon(1e-10));
    }
}

TEST_CASE("hand: an overdamped hand under a constant force creeps to balance as the formula predicts", "[hand]") {
    // b² > 4 k m: 0.1 kg, 0.5 N/mm, 50 N·s/m. In N, mm, ms: m = 100, b = 50, k = 0.5, so γ = 0.25 and δ² = 0.0625 -
    // 0.005.
    const double decay = 0.25, delta = std::sqrt(0.0625 - 0.005);
    Hand hand(HandParameters::fromTranslation(0.1, 0.5, 50), {});
    for (int i = 1; i <= 200; ++i) {
        hand.advance({}, {.force = {0, 1, 0}}, 1);
        const double expected =
            2 * (1 - std::exp(-decay * i) * (std::cosh(delta * i) + decay / delta * std::sinh(delta * i)));
        REQUIRE(hand.pose().p.y() == Approx(expected).margin(1e-12));
    }
}

TEST_CASE("hand: under torque about one axis it is an oscillator with its inertia", "[hand]") {
    // Inertia 0.1·50² = 250 kg·mm², spring 1·45² = 2025 mN·m/rad: sqrt(2.025 / 250e-6) = 90 rad/s.
    Hand hand(HandParameters::fromTranslation(0.1, 1, 0), {Vec3::Zero(), expRotation({0, 0.5, 0})});
    for (int i = 1; i <= 500; ++i) {
        hand.advance({}, {}, 1);
        REQUIRE(logRotation(hand.pose().q).y() == Approx(0.5 * std::cos(0.09 * i)).margin(1e-10));
    }
}

TEST_CASE("hand: with a fixed target it never gains energy over the whole range, and damping dissipates it", "[hand]") {
    const unsigned seed = std::random_device{}();
    INFO("seed " << seed);
    std::mt19937 random(seed);
    for (int round = 0; round < 200; ++round) {
        const HandParameters parameters = anyHand(random);
        const double dt = std::uniform_real_distribution<double>(0.1, 4)(random);
        const Pose target{anyVector(random, 50), expRotation(anyVector(random, 1.5))};
        Hand hand(parameters, {target.p + anyVector(random, 50), expRotation(anyVector(random, 1)) * target.q});
        // First a push in another direction, so that the rotation does not stay about one axis.
        for (int i = 0; i < 10; ++i) hand.advance(target, {anyVector(random, 5), anyVector(random, 100)}, dt);
        const double start = hand.energy(target);
        double energy = start;
        for (int i = 0; i < 2000; ++i) {
            hand.advance(target, {}, dt);
            const double now = hand.energy(target);
            // Rounding of sums of about 1e3 mJ.
            REQUIRE(now <= energy * (1 + 1e-12) + 1e-9);
            energy = now;
        }
        // Its slowest mode decays by e^(-γ t), if it is overdamped by e^(-(γ - δ) t), and its energy by the square.
        const double decay = parameters.damping / (2000 * parameters.mass),
                     stiffness = parameters.spring / (1000 * parameters.mass),
                     slowest =
                         decay * decay > stiffness ? stiffness / (decay + std::sqrt(decay * decay - stiffness)) : decay,
                     bound = std::exp(-slowest * 2000 * dt);
        if (parameters.damping > 1) CHECK(energy <= start * std::max(bound, 1e-20) * 4 + 1e-9);
    }
}

TEST_CASE("hand: extreme parameters and long ticks stay finite and stable", "[hand]") {
    for (const double mass : {1e-3, 0.1, 10.0})
        for (const double spring : {1e-3, 1.0, 100.0})
            for (const double damping : {0.0, 1.0, 1e4})
                for (const double dt : {1e-3, 1.0, 100.0}) {
                    Hand hand(HandParameters::fromTranslation(mass, spring, damping),
                              {{7, 0, 0}, expRotation({0, 0, 1})});
                    for (int i = 0; i < 1000; ++i) hand.advance({}, {}, dt);
                    INFO(mass << ' ' << spring << ' ' << damping << ' ' << dt);
                    CHECK(hand.pose().isFinite());
                    CHECK(hand.pose().p.norm() <= 7 * (1 + 1e-9));
                    CHECK(logRotation(hand.pose().q).norm() <= 1 + 1e-9);
                }
}

TEST_CASE("hand: non-finite input changes nothing", "[hand]") {
    Hand hand({}, {{1, 2, 3}, Quat::Identity()});
    hand.advance({}, {{1, 0, 0}, {0, 1, 0}}, 1);
    const Pose before = hand.pose();
    const Vec3 velocity = hand.velocity();
    Pose bad;
    bad.p.x() = std::nan("");
    hand.advance(bad, {}, 1);
    hand.advance({}, {{INFINITY, 0, 0}, {0, 0, 0}}, 1);
    hand.advance({}, {}, std::nan(""));
    CHECK(hand.pose().p == before.p);
    CHECK(hand.pose().q.coeffs() == before.q.coeffs());
    CHECK(hand.velocity() == velocity);
}

}  // namespace touchstone::hand_tests
