// Parts that fit to a hundredth of a millimeter: their clearances as the meshes have them.
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "tests/parts/mesh_checks.hpp"
#include "tests/parts/mesh_distance.hpp"
#include "tools/parts/nut.hpp"
#include "tools/parts/peg.hpp"
#include "tools/parts/shapes.hpp"

namespace touchstone::app::close_fits_tests {
namespace {

constexpr double kPi = std::numbers::pi;

/// Positions are stored as float, in meters: at 10 mm to 5e-7 mm in each coordinate of both parts.
constexpr double kStored = 2e-6;

/// Distances of a part from a fixed one, in poses about the y axis.
struct Fit {
    engine::MeshData part;
    std::vector<Triangle> fixed;
    TriangleBvh tree;

    Fit(engine::MeshData moved, const engine::MeshData& other)
        : part(std::move(moved)), fixed(trianglesOf(other)), tree(fixed) {}

    double at(double y, double angle, double bound) const {
        return distanceOf(trianglesOf(part, y, angle), tree, fixed, bound);
    }
};

/// Vertices of the mesh in the half-plane at this angle about y, as (height, radius) by rising height.
std::map<double, double> sectionAt(const engine::MeshData& mesh, double angle) {
    std::map<double, double> section;
    for (const glm::vec3& q : mesh.positions) {
        const glm::dvec3 p = 1000.0 * glm::dvec3(q);
        const double along = p.x * std::cos(angle) - p.z * std::sin(angle);
        const double beside = p.x * std::sin(angle) + p.z * std::cos(angle);
        if (along > 1 && std::abs(beside) < 1e-5) section[p.y] = along;
    }
    return section;
}

/// The corners of a section between two heights.
std::vector<glm::dvec2> corners(const std::map<double, double>& section, double low, double high) {
    std::vector<glm::dvec2> points;
    for (const auto& [y, r] : section)
        if (y > low && y < high) points.push_back({y, r});
    return points;
}

}  // namespace

TEST_CASE("peg: closed parts without intersections of their own faces", "[parts]") {
    PegFit fit;
    fit.segments = GENERATE(360, 1024);
    for (const engine::MeshData& mesh : {peg(fit), pegHole(fit)}) {
        CHECK(isClosed(mesh));
        CHECK(volume(mesh) > 0);
        CHECK(selfIntersections(mesh) == 0);
    }
}

TEST_CASE("peg: coaxial walls are the clearance apart at any turn", "[parts]") {
    PegFit fit;
    fit.segments = GENERATE(360, 1024);
    CAPTURE(fit.segments);
    const Fit parts(peg(fit), pegHole(fit));
    // A corner of the peg lies within half a step of the least common multiple from the middle of a side.
    const double step = kPi / std::lcm(fit.segments, fit.holeSides());
    const double most = fit.diameter / 2 * (1 - std::cos(step));
    for (const double turn : {0.0, 0.5 * step, step, 0.001, 0.0087, 0.3, 1.0, 2.5}) {
        const double distance = parts.at(-20, turn, 0.02);  // 10 mm above the bottom
        INFO("turned by " << turn);
        CHECK(distance >= fit.clearance - kStored);
        CHECK(distance <= fit.clearance + most + kStored);
    }
    // Equal counts fit more loosely where corners face corners.
    fit.holeSegments = fit.segments;
    const Fit equal(peg(fit), pegHole(fit));
    const double looser = (fit.diameter / 2 + fit.clearance) / std::cos(kPi / fit.segments) - fit.diameter / 2;
    CHECK(equal.at(-20, kPi / fit.segments, 0.02) == Approx(fit.clearance).margin(kStored));
    CHECK(equal.at(-20, 0, 0.02) > fit.clearance + 0.9 * (looser - fit.clearance) * std::cos(kPi / fit.segments));
    CHECK(equal.at(-20, 0, 0.02) < looser);
}

TEST_CASE("peg: impossible dimensions are refused in one sentence", "[parts]") {
    PegFit fit;
    fit.chamfer = 9;
    CHECK_THROWS_WITH(peg(fit), Catch::Contains("chamfer"));
    fit = {};
    fit.clearance = -0.01;
    CHECK_THROWS_WITH(pegHole(fit), Catch::Contains("clearance"));
    fit = {};
    fit.segments = 5;
    CHECK_THROWS_WITH(peg(fit), Catch::Contains("segments"));
}

TEST_CASE("spline fit: a hundredth of a millimeter on each side, at the ends of its turning play too", "[parts]") {
    SplineFit fit;
    fit.clearance = GENERATE(0.01, 0.02);
    fit.chamfer = 0.5;
    const Fit parts(splinedShaft(fit), splinedHole(fit));
    CHECK(parts.at(-20, 0, 0.05) == Approx(fit.clearance).margin(kStored));
    // The flanks touch when the key's tip, 15 mm out, has moved by the clearance.
    const double play = fit.clearance / 15;
    CHECK(parts.at(-20, 0.9 * play, 0.05) == Approx(0.1 * fit.clearance).margin(0.02 * fit.clearance));
    CHECK(parts.at(-20, 1.1 * play, 0.05) == 0);
}

TEST_CASE("thread: closed parts without intersections of their own faces", "[parts]") {
    ThreadFit fit;
    const auto [segments, nutSegments] = GENERATE(std::pair(156, 0), std::pair(96, 96), std::pair(96, 97));
    fit.segments = segments, fit.nutSegments = nutSegments;
    CAPTURE(segments, nutSegments);
    std::size_t triangles = 0;
    for (const engine::MeshData& mesh : {bolt(fit), nut(fit)}) {
        CHECK(isClosed(mesh));
        CHECK(volume(mesh) > 0);
        CHECK(selfIntersections(mesh) == 0);
        triangles += mesh.indices.size() / 3;
    }
    if (segments == 156) CHECK(triangles == Approx(19000).epsilon(0.02));
}

TEST_CASE("thread: the bolt has the basic profile of ISO 68-1", "[parts]") {
    const ThreadFit fit;
    const double P = 2, H = std::sqrt(3.0) / 2 * P;
    const engine::MeshData mesh = bolt(fit);
    for (const int quarter : {0, 1, 2, 3}) {
        const std::vector<glm::dvec2> section = corners(sectionAt(mesh, quarter * kPi / 2), 0.9, 9.1);
        REQUIRE(section.size() >= 12);
        int crests = 0, roots = 0, flanks = 0;
        for (std::size_t i = 0; i + 1 < section.size(); ++i) {
            const glm::dvec2 a = section[i], b = section[i + 1];
            if (std::abs(a.y - b.y) < 1e-5) {
                const bool crest = a.y > 7.5;
                crest ? ++crests : ++roots;
                CHECK(a.y == Approx(crest ? 8 : 8 - 5 * H / 8).margin(1e-6));
                CHECK(b.x - a.x == Approx(crest ? P / 8 : P / 4).margin(2e-6));
                // Right-handed: the crest in the plane y = 0 at +x climbs by a quarter of the pitch in a quarter turn.
                if (crest) CHECK(std::remainder((a.x + b.x) / 2 - quarter * P / 4, P) == Approx(0).margin(2e-6));
            } else {
                ++flanks;
                CHECK(std::atan2(b.x - a.x, std::abs(b.y - a.y)) == Approx(kPi / 6).margin(1e-5));
            }
        }
        CHECK(crests >= 3);
        CHECK(roots >= 3);
        CHECK(flanks >= 6);
    }
}

TEST_CASE("thread: nut and bolt are the clearance apart at any turn, and touch at the ends of the play", "[parts]") {
    ThreadFit fit;
    const auto [segments, nutSegments] = GENERATE(std::pair(156, 0), std::pair(96, 96), std::pair(96, 97));
    fit.segments = segments, fit.nutSegments = nutSegments;
    CAPTURE(segments, nutSegments);
    const Fit parts(nut(fit), bolt(fit));
    // What lies between sections is straight: that opens flanks by up to half a sagitta. Where a mouth of the nut cuts
    // a crest off between two sections it takes about one away, and where the bolt's chamfer does, two.
    const double sagitta = fit.diameter / 2 * (1 - std::cos(kPi / segments));
    for (const double turn : {0.0, 0.01, 0.5, 2.0, -3.0, 11.0, 18.26, 23.0}) {
        INFO("turned by " << turn);
        const double aligned = fit.pitch * turn / (2 * kPi);
        const double off = (aligned + fit.height < 12 ? 1.3 : 2.5) * sagitta;
        const double distance = parts.at(aligned, turn, 0.1);
        CHECK(distance >= fit.clearance - off);
        CHECK(distance <= fit.clearance + sagitta / 2);
        for (const double way : {-1.0, 1.0}) {
            CHECK(parts.at(aligned + way * 0.8 * fit.play(), turn, 0.1) == Approx(0.2 * fit.clearance).margin(off));
            CHECK(parts.at(aligned + way * 1.1 * fit.play(), turn, 0.1) == 0);
            CHECK(parts.at(aligned, turn + way * 1.1 * fit.playAngle(), 0.1) == 0);
        }
    }
    // A turn without the advance jams: the thread is not a set of grooves.
    CHECK(parts.at(fit.pitch / 2, 0, 0.1) == 0);
}

TEST_CASE("thread: impossible dimensions are refused in one sentence", "[parts]") {
    ThreadFit fit;
    fit.clearance = 0.5;
    CHECK_THROWS_WITH(nut(fit), Catch::Contains("clearance"));
    fit = {};
    fit.height = 2;
    CHECK_THROWS_WITH(nut(fit), Catch::Contains("nut must be higher"));
    fit = {};
    fit.diameter = 2;
    CHECK_THROWS_WITH(bolt(fit), Catch::Contains("thicker"));
    fit = {};
    fit.pitch = 13;
    CHECK_THROWS_WITH(bolt(fit), Catch::Contains("pitch must be smaller"));
    fit = {};
    fit.flank = 0;
    CHECK_THROWS_WITH(bolt(fit), Catch::Contains("flank of a thread"));
    fit = {};
    fit.depth = 1.7;
    CHECK_THROWS_WITH(bolt(fit), Catch::Contains("less deep"));
    fit = {};
    fit.segments = 3;
    CHECK_THROWS_WITH(bolt(fit), Catch::Contains("segments"));
}

}  // namespace touchstone::app::close_fits_tests
