// Screw surfaces, from points and normals that are computed here.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <vector>

#include "engine/scene/screw_surface.hpp"

namespace touchstone::engine {
namespace {

constexpr double kWholeTurn = 2 * std::numbers::pi;
const glm::dquat kScrewTilt = glm::normalize(glm::dquat(0.8, 0.3, -0.4, 0.2));
const glm::dvec3 kScrewPlace(0.3, -0.2, 0.1);

/// A grid of points with normals by differences, tilted and moved, off by `noise` in turns.
std::vector<SurfacePoint> sampled(const std::function<glm::dvec3(double, double)>& at, double noise = 0) {
    std::vector<SurfacePoint> points;
    constexpr double kStep = 1e-6;
    for (int i = 0; i < 12; ++i)
        for (int j = 0; j < 5; ++j) {
            const double u = i / 11.0, v = j / 4.0;
            const glm::dvec3 du = at(u + kStep, v) - at(u - kStep, v), dv = at(u, v + kStep) - at(u, v - kStep);
            const glm::dvec3 normal = glm::normalize(glm::cross(du, dv));
            points.push_back({kScrewPlace + kScrewTilt * (at(u, v) + noise * ((i + j) % 2 ? 1.0 : -1.0) * normal),
                              kScrewTilt * normal});
        }
    return points;
}

glm::dvec3 onRound(double r, double angle, double z) { return {r * std::cos(angle), r * std::sin(angle), z}; }

void checkAxis(const ScrewSurface& found) {
    const glm::dvec3 axis = kScrewTilt * glm::dvec3(0, 0, 1);
    CHECK(glm::length(glm::cross(found.axis, axis)) < 1e-6);
    CHECK(glm::length(glm::cross(found.point - kScrewPlace, axis)) < 1e-8);  // m, of parts of some mm
}

TEST_CASE("screw surface: a flank of a thread has its lead and hand", "[cad]") {
    for (const double lead : {0.002, -0.002, 0.00125, 0.009})
        for (const double turns : {0.5, 1.0, 8.0}) {
            CAPTURE(lead, turns);
            const auto flank = [&](double u, double v) {
                return onRound(0.0068 + 0.0011 * v, kWholeTurn * turns * u, lead * turns * u + 0.0006 * v);
            };
            const auto found = screwSurface(sampled(flank));
            REQUIRE(found);
            CHECK_FALSE(found->cylinder);
            CHECK(found->lead == Approx(lead).epsilon(1e-5));
            CHECK(found->inner == Approx(0.0068).epsilon(1e-6));
            CHECK(found->outer == Approx(0.0079).epsilon(1e-6));
            checkAxis(*found);
        }
}

TEST_CASE("screw surface: a crest of a thread is a cylinder", "[cad]") {
    const auto crest = [](double u, double v) { return onRound(0.008, 8 * kWholeTurn * u, 0.016 * u + 0.00025 * v); };
    const auto found = screwSurface(sampled(crest));
    REQUIRE(found);
    CHECK(found->cylinder);
    CHECK(found->lead == 0);
    CHECK(found->outer == Approx(0.008).epsilon(1e-6));
    checkAxis(*found);
}

TEST_CASE("screw surface: other surfaces are not taken for one", "[cad]") {
    CHECK_FALSE(screwSurface(sampled([](double u, double v) { return glm::dvec3(u, v, 0); })));
    CHECK_FALSE(screwSurface(sampled([](double u, double v) { return onRound(std::cos(v), u, std::sin(v)); })));
    CHECK_FALSE(screwSurface(sampled([](double u, double v) { return onRound(1 + v * v, 3 * u, v); })));  // turned
    CHECK_FALSE(screwSurface(sampled([](double u, double v) { return glm::dvec3(u, u * u * u, v); })));   // extruded
    CHECK_FALSE(screwSurface(sampled([](double u, double v) { return glm::dvec3(u, v, u * u * v + v * v); })));
    CHECK_FALSE(screwSurface({}));
    // A thread whose lead grows.
    CHECK_FALSE(screwSurface(sampled(
        [](double u, double v) { return onRound(0.007 + 0.001 * v, 6 * kWholeTurn * u, 0.01 * u * (1 + 0.2 * u)); })));
}

TEST_CASE("screw surface: a spline that is off by a ten-millionth of its radius is one", "[cad]") {
    const auto flank = [](double u, double v) {
        return onRound(0.0068 + 0.0011 * v, kWholeTurn * 4 * u, 0.008 * u + 0.0006 * v);
    };
    const auto found = screwSurface(sampled(flank, 1e-9));
    REQUIRE(found);
    CHECK(found->lead == Approx(0.002).epsilon(1e-4));
}

}  // namespace
}  // namespace touchstone::engine
