#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <set>

#include "tools/parts/planar.hpp"

namespace touchstone::app::planar_tests {
namespace {

const Outline kSquare{{0, 0}, {10, 0}, {10, 10}, {0, 10}};

double areaOf(const PlanarMesh& mesh) {
    double area = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
        const double part = signedArea({mesh.points[a], mesh.points[b], mesh.points[c]});
        REQUIRE(part > 0);
        area += part;
    }
    return area;
}

/// Edges that are used once; they form the border.
std::set<std::pair<std::uint32_t, std::uint32_t>> border(const PlanarMesh& mesh) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& t : mesh.triangles)
        for (int i = 0; i < 3; ++i)
            if (!edges.erase({t[(i + 1) % 3], t[i]})) edges.insert({t[i], t[(i + 1) % 3]});
    return edges;
}

}  // namespace

TEST_CASE("outline: a square grows and shrinks with square corners", "[parts]") {
    CHECK(signedArea(kSquare) == Approx(100));
    CHECK(signedArea(offset(kSquare, 1)) == Approx(144));  // 12 x 12
    CHECK(signedArea(offset(kSquare, -2)) == Approx(36));  // 6 x 6
    CHECK(offset(kSquare, 1)[0] == glm::dvec2(-1, -1));
    CHECK(offset(kSquare, 0) == kSquare);
    CHECK_THROWS_AS(offset(kSquare, -5.5), std::invalid_argument);
}

TEST_CASE("outline: an inner corner loses the edges that the shift consumes", "[parts]") {
    // A notch 4 wide at the top, shifted by 1.5: 1 of its width remains, and its divided walls lose their lowest
    // pieces.
    const Outline notched = subdivided({{0, 0}, {20, 0}, {20, 10}, {12, 10}, {12, 5}, {8, 5}, {8, 10}, {0, 10}}, 0.5);
    const Outline grown = offset(notched, 1.5);
    CHECK(grown.size() == notched.size());
    CHECK(withoutRepeats(grown).size() < notched.size());
    // 23 x 13 minus the notch, with its floor now at 6.5 and its mouth at 11.5.
    CHECK(signedArea(grown) == Approx(23 * 13 - 1 * (11.5 - 6.5)));
}

TEST_CASE("outline: a circle keeps its chord error and spacing", "[parts]") {
    const Outline fine = circle(15, 0.01, 10), coarse = circle(15, 1, 2);
    const auto sagitta = [](const Outline& o) { return 15 - glm::length((o[0] + o[1]) / 2.0); };
    CHECK(sagitta(fine) <= 0.01);
    CHECK(sagitta(fine) > 0.009);  // not finer than requested
    CHECK(glm::distance(coarse[0], coarse[1]) <= 2);
}

TEST_CASE("triangulation: a ring is covered once and its outlines are kept", "[parts]") {
    const Outline outer = circle(20, 0.01, 1), hole = circle(12, 0.01, 1);
    const PlanarMesh mesh = triangulate(outer, hole, 1);
    CHECK(areaOf(mesh) == Approx(signedArea(outer) - signedArea(hole)).epsilon(1e-12));  // only rounding
    const auto edges = border(mesh);
    CHECK(edges.size() == outer.size() + hole.size());
    for (std::uint32_t i = 0; i < outer.size(); ++i)
        CHECK(edges.contains({i, (i + 1) % static_cast<std::uint32_t>(outer.size())}));
    // Euler: one component with one hole has V - E + F = 0, and E = (3 F + border) / 2.
    const std::size_t twiceEdges = 3 * mesh.triangles.size() + edges.size();
    CHECK(2 * mesh.points.size() + 2 * mesh.triangles.size() == twiceEdges);
}

TEST_CASE("triangulation: straight sides with collinear points need no extra point", "[parts]") {
    const Outline outer = subdivided(kSquare, 0.7);
    const PlanarMesh mesh = triangulate(outer, {}, 0.7);
    CHECK(areaOf(mesh) == Approx(100).epsilon(1e-12));
    CHECK(border(mesh).size() == outer.size());
}

TEST_CASE("triangulation: an outline that is too coarse for a narrow gap is refused", "[parts]") {
    // Points every 0.5 are 0.1 away from an edge of 8: every circle through its ends contains some of them.
    const Outline hole{{1, 0.1}, {9, 0.1}, {9, 9}, {1, 9}};
    CHECK_THROWS_AS(triangulate(subdivided(kSquare, 0.5), hole, 0.5), std::invalid_argument);
    CHECK_NOTHROW(triangulate(subdivided(kSquare, 0.1), subdivided(hole, 0.1), 0.5));
}

}  // namespace touchstone::app::planar_tests
