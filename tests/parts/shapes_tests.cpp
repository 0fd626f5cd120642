#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/parts/mesh_checks.hpp"
#include "tools/parts/shapes.hpp"

namespace touchstone::app::shapes_tests {
namespace {

constexpr double kPi = std::numbers::pi;

/// Area of a splined cross-section with true arcs: the root disc, and each key from root circle to key top.
double splineArea(double tip, double root, double width, int keys) {
    const auto strip = [&](double r) {  // half of the disc's part within width/2 of the axis
        return width / 2 * std::sqrt(r * r - width * width / 4) + r * r * std::asin(width / 2 / r);
    };
    return kPi * root * root + keys * (strip(tip) - strip(root));
}

/// Chords are at most kChordError inside an arc, so the area is smaller by at most kChordError along the arcs.
double chordLoss(double tip) { return 2 * kPi * tip * kChordError; }

}  // namespace

TEST_CASE("box: closed, with exact volume and flat normals", "[parts]") {
    const engine::MeshData mesh = box({60, 1, 40}, 2);
    CHECK(isClosed(mesh));
    CHECK(volume(mesh) == Approx(2400).epsilon(1e-6));  // positions are stored as float
    CHECK(longestEdge(mesh) <= 2 * std::sqrt(2.0) + 1e-6);
    for (const glm::vec3& n : mesh.normals) CHECK(std::abs(n.x) + std::abs(n.y) + std::abs(n.z) == 1);
}

TEST_CASE("sphere: closed, within the chord error, normals radial", "[parts]") {
    const engine::MeshData mesh = sphere(12);
    CHECK(isClosed(mesh));
    CHECK(leastAngle(mesh) > 0.9);
    CHECK(volume(mesh) <= 4 * kPi / 3 * 12 * 12 * 12);
    CHECK(volume(mesh) >= 4 * kPi / 3 * std::pow(12 - kChordError, 3));
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        REQUIRE(glm::dot(glm::normalize(mesh.positions[i]), mesh.normals[i]) > 0.9999f);  // faces are 1 degree apart
}

TEST_CASE("pebble: closed, bumpy, of any number of triangles on the same surface", "[parts]") {
    const engine::MeshData coarse = pebble(2000, 1), fine = pebble(20000, 1), other = pebble(2000, 2);
    double inner = 100, outer = 0, apart = 0;  // mm
    for (const engine::MeshData& mesh : {coarse, fine, other}) {
        CHECK(isClosed(mesh));
        CHECK(leastAngle(mesh) > 0.3);
        CHECK(volume(mesh) == Approx(4 * kPi / 3 * 27000).epsilon(0.1));
        for (const glm::vec3& p : mesh.positions) {
            inner = std::min(inner, 1000.0 * glm::length(p));
            outer = std::max(outer, 1000.0 * glm::length(p));
        }
    }
    CHECK(inner > 26);  // 16 waves of 0.25 mm
    CHECK(outer < 34);
    CHECK(outer - inner > 2);
    CHECK(coarse.indices.size() / 3 == Approx(2000).epsilon(0.1));
    CHECK(fine.indices.size() / 3 == Approx(20000).epsilon(0.03));
    // Points of the coarse one lie on the fine one but for its chords: edges of 1 mm over waves of 12 mm and more.
    for (std::size_t i = 0; i < coarse.positions.size(); i += 50)
        CHECK(distanceTo(fine, 1000.0 * glm::dvec3(coarse.positions[i])) < 0.05);
    for (std::size_t i = 0; i < coarse.positions.size(); i += 50)
        apart = std::max(apart, distanceTo(fine, 1000.0 * glm::dvec3(other.positions[i])));
    CHECK(apart > 0.5);
    CHECK_THROWS_WITH(pebble(47, 1), Catch::Contains("at least 48"));
}

TEST_CASE("cylinder: closed, smooth around and sharp at the ends", "[parts]") {
    const engine::MeshData mesh = cylinder(9, 40, 2);
    CHECK(isClosed(mesh));
    CHECK(volume(mesh) <= kPi * 81 * 40);
    CHECK(volume(mesh) >= kPi * 81 * 40 - 40 * chordLoss(9));
    for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
        const glm::vec3 n = mesh.normals[i], p = mesh.positions[i];
        if (std::abs(n.y) > 1e-3f)
            REQUIRE(std::abs(n.y) == Approx(1));
        else
            REQUIRE(glm::dot(n, glm::normalize(glm::vec3(p.x, 0, p.z))) > 0.99f);
    }
}

TEST_CASE("splined shaft: closed, with the volume of the profile", "[parts]") {
    for (const int keys : {4, 6, 8, 12}) {
        SplineFit fit;
        fit.keys = keys;
        fit.keyWidth = keys == 12 ? 3 : 5;
        const engine::MeshData mesh = splinedShaft(fit);
        const double exact = fit.length * splineArea(15, 12, fit.keyWidth, keys);
        INFO(keys << " keys");
        CHECK(isClosed(mesh));
        CHECK(volume(mesh) <= exact * (1 + 1e-6));
        CHECK(volume(mesh) >= exact - fit.length * chordLoss(15));
        CHECK(leastAngle(mesh) > 0.15);
    }
}

TEST_CASE("splined shaft: a chamfer removes the edge of the leading end", "[parts]") {
    SplineFit fit;
    fit.chamfer = 1;
    const engine::MeshData mesh = splinedShaft(fit);
    CHECK(isClosed(mesh));
    double endRadius = 0, fullRadius = 0;
    for (const glm::vec3& p : mesh.positions) {
        const double radius = 1000 * std::hypot(p.x, p.z);
        if (p.y == 0) endRadius = std::max(endRadius, radius);
        fullRadius = std::max(fullRadius, radius);
    }
    CHECK(fullRadius == Approx(15).epsilon(1e-6));
    CHECK(endRadius == Approx(14).margin(kChordError));  // the chords of the key top have moved in by 1
}

TEST_CASE("splined hole: closed, blind or through, with and without chamfer", "[parts]") {
    for (const bool blind : {true, false})
        for (const double chamfer : {0.0, 1.0}) {
            SplineFit fit;
            fit.blind = blind;
            fit.chamfer = chamfer;
            const engine::MeshData mesh = splinedHole(fit);
            INFO("blind " << blind << ", chamfer " << chamfer);
            CHECK(isClosed(mesh));
            const double outer = 15 + fit.clearance + fit.wall;
            const double full = kPi * outer * outer * (fit.depth + (blind ? fit.wall : 0));
            const double bore =
                fit.depth * splineArea(15 + fit.clearance, 12 + fit.clearance, 5 + 2 * fit.clearance, 8);
            if (chamfer == 0)
                CHECK(volume(mesh) == Approx(full - bore).margin(fit.depth * 2 * chordLoss(outer)));
            else
                CHECK(volume(mesh) < full - bore);
        }
}

TEST_CASE("spline fit: every face of the shaft has the clearance to the hole", "[parts]") {
    const auto seed = GENERATE(1u, 2u);
    for (const double clearance : {0.2, 0.5, 1.2}) {
        SplineFit fit;
        fit.clearance = clearance;
        const engine::MeshData shaft = splinedShaft(fit), hole = splinedHole(fit);
        std::mt19937 random(seed);
        std::uniform_int_distribution<std::size_t> triangle(0, shaft.indices.size() / 3 - 1);
        std::uniform_real_distribution<double> unit(0, 1);
        double nearest = 1e300, furthest = 0;
        // Where flank and root meet, only the corner of the hole is near: the distance may be larger there.
        const auto fromInnerCorner = [](const glm::dvec3& p) {
            double least = 1e300;
            for (int key = 0; key < 8; ++key)
                for (const double side : {-2.5, 2.5}) {
                    const double angle = key * kPi / 4 + std::asin(side / 12);
                    least = std::min(least, std::hypot(p.x - 12 * std::cos(angle), p.z + 12 * std::sin(angle)));
                }
            return least;
        };
        for (int sample = 0; sample < 150;) {
            const std::size_t t = 3 * triangle(random);
            double u = unit(random), v = unit(random);
            if (u + v > 1) u = 1 - u, v = 1 - v;
            glm::dvec3 p = corner(shaft, t) + u * (corner(shaft, t + 1) - corner(shaft, t)) +
                           v * (corner(shaft, t + 2) - corner(shaft, t));
            if (std::abs(shaft.normals[shaft.indices[t]].y) > 0.5f) continue;  // on an end face
            p.y = -5 - unit(random) * 25;  // the shaft is half way in, away from mouth and bottom
            const double distance = distanceTo(hole, p);
            nearest = std::min(nearest, distance);
            if (fromInnerCorner(p) > clearance) furthest = std::max(furthest, distance);
            ++sample;
        }
        INFO("seed " << seed << ", clearance " << clearance);
        // Positions are stored as float: 1e-6 mm at these sizes, in both parts.
        CHECK(nearest >= clearance - 1e-5);
        CHECK(furthest <= clearance + 1e-5);
    }
}

TEST_CASE("spline fit: impossible dimensions are refused in one sentence", "[parts]") {
    SplineFit fit;
    fit.keyWidth = 12;  // eight of them do not fit around 24 mm
    CHECK_THROWS_WITH(splinedShaft(fit), Catch::Contains("overlap"));
    fit = {};
    fit.keyDepth = 16;
    CHECK_THROWS_WITH(splinedShaft(fit), Catch::Contains("depth of the keys"));
    fit = {};
    fit.clearance = -0.1;
    CHECK_THROWS_WITH(splinedHole(fit), Catch::Contains("clearance"));
    fit = {};
    fit.chamfer = 3;
    CHECK_THROWS_WITH(splinedHole(fit), Catch::Contains("chamfer"));
}

}  // namespace touchstone::app::shapes_tests
