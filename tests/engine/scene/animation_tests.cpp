#include "engine/scene/animation.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

namespace touchstone::animation_tests {

using namespace touchstone::engine;

namespace {

// Rounding of a few double operations on values near 1.
constexpr double kRounding = 1e-14;

AnimationChannel vectorChannel(Interpolation interpolation, std::vector<glm::dvec4> values) {
    return {{}, AnimationPath::Translation, interpolation, {1, 3}, std::move(values)};
}

/// Rotation about z by an angle in degrees, as glTF stores it.
glm::dvec4 aboutZ(double degrees) {
    const double half = glm::radians(degrees) / 2;
    return {0, 0, std::sin(half), std::cos(half)};
}

double degreesAboutZ(const glm::dquat& q) { return glm::degrees(2 * std::atan2(q.z, q.w)); }

}  // namespace

TEST_CASE("animation: linear translation between keys, held before and after", "[animation]") {
    const auto channel = vectorChannel(Interpolation::Linear, {{0, 0, 0, 0}, {4, -8, 2, 0}});
    CHECK(sampleVector(channel, 1.5) == glm::dvec3(1, -2, 0.5));
    CHECK(sampleVector(channel, -7) == glm::dvec3(0));
    CHECK(sampleVector(channel, 1) == glm::dvec3(0));
    CHECK(sampleVector(channel, 3) == glm::dvec3(4, -8, 2));
    CHECK(sampleVector(channel, 1e9) == glm::dvec3(4, -8, 2));
}

TEST_CASE("animation: a step keeps its value until the next key", "[animation]") {
    const auto channel = vectorChannel(Interpolation::Step, {{1, 0, 0, 0}, {2, 0, 0, 0}});
    CHECK(sampleVector(channel, 2.999).x == 1);
    CHECK(sampleVector(channel, 3).x == 2);
}

TEST_CASE("animation: a single key holds forever", "[animation]") {
    const AnimationChannel channel{{}, AnimationPath::Scale, Interpolation::Linear, {2}, {{5, 6, 7, 0}}};
    for (const double t : {0.0, 2.0, 9.0}) CHECK(sampleVector(channel, t) == glm::dvec3(5, 6, 7));
}

TEST_CASE("animation: the cubic spline follows the Hermite formula with tangents scaled by the step", "[animation]") {
    // Keys at 1 s and 3 s: step 2. v0 = 1, b0 = 3, a1 = -1, v1 = 2. At a quarter, t = 0.25:
    // 2t^3 - 3t^2 + 1 = 0.84375, t^3 - 2t^2 + t = 0.140625, 3t^2 - 2t^3 = 0.15625, t^3 - t^2 = -0.046875;
    // 0.84375 * 1 + 2 * 0.140625 * 3 + 0.15625 * 2 + 2 * -0.046875 * -1 = 2.09375.
    const auto channel =
        vectorChannel(Interpolation::CubicSpline,
                      {{9, 9, 9, 0}, {1, 0, 0, 0}, {3, 0, 0, 0}, {-1, 0, 0, 0}, {2, 0, 0, 0}, {9, 9, 9, 0}});
    CHECK(sampleVector(channel, 1.5).x == Approx(2.09375).epsilon(kRounding));
    CHECK(sampleVector(channel, 1).x == 1);
    CHECK(sampleVector(channel, 3).x == 2);
    CHECK(sampleVector(channel, 0).x == 1);
    CHECK(sampleVector(channel, 4).x == 2);
}

TEST_CASE("animation: a cubic spline through samples of a cubic is that cubic", "[animation]") {
    // p(t) = t^3 - 2t, p'(t) = 3t^2 - 2, keys at 0, 0.5 and 2.
    AnimationChannel channel{{}, AnimationPath::Translation, Interpolation::CubicSpline, {0, 0.5, 2}, {}};
    for (const double t : channel.times) {
        const glm::dvec4 slope(3 * t * t - 2, 0, 0, 0);
        channel.values.insert(channel.values.end(), {slope, {t * t * t - 2 * t, 0, 0, 0}, slope});
    }
    for (double t = 0; t <= 2; t += 0.01) CHECK(sampleVector(channel, t).x == Approx(t * t * t - 2 * t).margin(1e-13));
}

TEST_CASE("animation: rotations turn at a constant rate along the shorter path", "[animation]") {
    AnimationChannel channel{{}, AnimationPath::Rotation, Interpolation::Linear, {0, 1}, {aboutZ(10), aboutZ(90)}};
    CHECK(degreesAboutZ(sampleRotation(channel, 0.25)) == Approx(30).epsilon(1e-12));
    channel.values[1] = -channel.values[1];  // the same rotation, on the opposite side of the sphere
    CHECK(degreesAboutZ(sampleRotation(channel, 0.25)) == Approx(30).epsilon(1e-12));
    channel.values = {aboutZ(170), aboutZ(-170)};
    const double middle = degreesAboutZ(sampleRotation(channel, 0.5));
    CHECK(std::abs(middle) == Approx(180).epsilon(1e-12));
}

TEST_CASE("animation: sampled rotations have unit length in every mode", "[animation]") {
    const unsigned seed = 7;
    CAPTURE(seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    const auto any = [&] { return glm::dvec4(normal(random), normal(random), normal(random), normal(random)); };
    for (const Interpolation mode : {Interpolation::Step, Interpolation::Linear, Interpolation::CubicSpline}) {
        AnimationChannel channel{{}, AnimationPath::Rotation, mode, {0, 1, 3}, {}};
        const std::size_t needed = mode == Interpolation::CubicSpline ? 9 : 3;
        for (std::size_t i = 0; i < needed; ++i) channel.values.push_back(any());
        for (double t = -1; t < 4; t += 0.03125)
            CHECK(glm::length(sampleRotation(channel, t)) == Approx(1).epsilon(kRounding));
    }
}

TEST_CASE("animation: a rotation spline through zero falls back to its key", "[animation]") {
    // With opposite values and zero tangents the middle of the spline is exactly zero.
    const AnimationChannel channel{{},
                                   AnimationPath::Rotation,
                                   Interpolation::CubicSpline,
                                   {0, 1},
                                   {glm::dvec4(0), aboutZ(0), glm::dvec4(0), glm::dvec4(0), -aboutZ(0), glm::dvec4(0)}};
    CHECK(sampleRotation(channel, 0.5) == glm::dquat(1, 0, 0, 0));
}

TEST_CASE("animation: a node keeps the properties that are not animated", "[animation]") {
    Registry registry;
    const Entity moved = registry.create(), still = registry.create();
    LocalTransform rest;
    rest.scale = glm::dvec3(2);
    registry.add(moved, rest);
    registry.add(still, rest);
    const Animation animation{
        "demo", {{moved, AnimationPath::Translation, Interpolation::Linear, {0, 2}, {{0, 0, 0, 0}, {2, 0, 0, 0}}}}};
    const LocalTransform sampled = sampleNode(animation, moved, rest, 1);
    CHECK(sampled.translation == glm::dvec3(1, 0, 0));
    CHECK(sampled.scale == glm::dvec3(2));
    CHECK(sampled.rotation == glm::dquat(1, 0, 0, 0));
    CHECK(animates(animation, moved));
    CHECK_FALSE(animates(animation, still));
    CHECK_FALSE(animates(animation, Entity{}));
    CHECK(endTime(animation) == 2);
    CHECK(endTime(Animation{}) == 0);
    applyAnimation(registry, animation, 2);
    CHECK(registry.get<LocalTransform>(moved).translation == glm::dvec3(2, 0, 0));
    CHECK(registry.get<LocalTransform>(still).translation == glm::dvec3(0));
}

}  // namespace touchstone::animation_tests
