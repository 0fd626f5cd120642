// Triangles within slabs, of areas that are drawn by hand.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <utility>

#include "tools/step/step_polygons.hpp"

namespace touchstone::polygon_tests {

using namespace touchstone::step;

namespace {

using Triangles = std::vector<std::array<int, 3>>;

/// Adds a closed line, with a node wherever it crosses a line between slabs, or a row.
void add(SlabArea& area, const std::vector<SlabNode>& corners) {
    const int first = int(area.nodes.size());
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const SlabNode &a = corners[i], &b = corners[(i + 1) % corners.size()];
        std::map<double, SlabNode> between;  // by the part of the way
        const auto cross = [&](double SlabNode::*across, double SlabNode::*along) {
            for (double line = std::floor(std::min(a.*across, b.*across)) + 1; line < std::max(a.*across, b.*across);
                 ++line) {
                const double part = (line - a.*across) / (b.*across - a.*across);
                SlabNode node;
                node.*across = line;
                node.*along = a.*along + part * (b.*along - a.*along);
                between.emplace(part, node);
            }
        };
        cross(&SlabNode::s, &SlabNode::v);
        if (area.rows) cross(&SlabNode::v, &SlabNode::s);
        area.nodes.push_back(a);
        for (const auto& [part, node] : between) area.nodes.push_back(node);
    }
    const int count = int(area.nodes.size()) - first;
    for (int i = 0; i < count; ++i) area.chords.push_back({first + i, first + (i + 1) % count});
}

double sizeOf(const SlabArea& area, const std::array<int, 3>& t) {
    const auto at = [&](int k) { return area.nodes[std::size_t(t[std::size_t(k)])]; };
    return ((at(1).s - at(0).s) * (at(2).v - at(0).v) - (at(2).s - at(0).s) * (at(1).v - at(0).v)) / 2;
}

/// Checks that the triangles fill the area once, keep to slabs and rows, and meet along whole edges; returns their
/// number.
int check(const SlabArea& area, double size) {
    Triangles triangles;
    REQUIRE(area.triangulate(triangles));
    double sum = 0;
    std::map<std::pair<int, int>, int> edges;
    for (const auto& t : triangles) {
        CHECK(sizeOf(area, t) >= 0);
        sum += sizeOf(area, t);
        for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
        const auto isWithinOne = [&](double SlabNode::*across) {
            const double at[]{area.nodes[std::size_t(t[0])].*across, area.nodes[std::size_t(t[1])].*across,
                              area.nodes[std::size_t(t[2])].*across};
            return std::ranges::max(at) <= std::floor(std::ranges::min(at)) + 1;
        };
        CHECK(isWithinOne(&SlabNode::s));
        if (area.rows) CHECK(isWithinOne(&SlabNode::v));
    }
    CHECK(sum == Approx(size));
    for (const auto& chord : area.chords)
        edges[{chord[1], chord[0]}] += 1;  // what lies on the other side of the boundary
    for (const auto& [edge, count] : edges) {
        CHECK(count == 1);
        CHECK(edges.contains({edge.second, edge.first}));
    }
    return int(triangles.size());
}

}  // namespace

TEST_CASE("polygons: the side of a cylinder has two triangles for each facet", "[cad]") {
    SlabArea area;
    add(area, {{0, 0}, {7, 0}, {7, 2}, {0, 2}});
    CHECK(check(area, 14) == 14);
}

TEST_CASE("polygons: an edge within a slab, and one in a line", "[cad]") {
    SlabArea area;
    add(area, {{0.5, 0}, {3, 0}, {3, 1}, {2, 1}, {2, 2}, {0.5, 2}});
    check(area, 4);
}

TEST_CASE("polygons: holes across slabs, within one, and touching a line", "[cad]") {
    SlabArea area;
    add(area, {{0, 0}, {6, 0}, {6, 4}, {0, 4}});
    add(area, {{1.5, 1}, {1.5, 3}, {3.5, 3}, {3.5, 1}});
    add(area, {{4.3, 1}, {4.3, 2}, {4.6, 2}, {4.6, 1}});
    add(area, {{5.5, 1}, {5, 2}, {5.5, 3}});
    check(area, 24 - 4 - 0.3 - 0.5);
}

TEST_CASE("polygons: an area with waists and dents", "[cad]") {
    SlabArea area;
    add(area, {{0, 0}, {2.5, 1.5}, {5, 0}, {4.2, 2}, {5, 4}, {2.5, 2.5}, {0, 4}, {0.8, 2}});
    check(area, 20 - 2 * 3.75 - 2 * 1.6);
}

TEST_CASE("polygons: a rectangle with rows has two triangles for each of its cells", "[cad]") {
    SlabArea area;
    area.rows = true;
    add(area, {{0, 0}, {7, 0}, {7, 3}, {0, 3}});
    area.addCrossings();
    CHECK(area.nodes.size() == 8 * 4);
    CHECK(check(area, 21) == 2 * 21);
}

TEST_CASE("polygons: rows in an area with dents, and holes across and within cells", "[cad]") {
    SlabArea area;
    area.rows = true;
    add(area, {{0, 0.5}, {2.5, 1.5}, {5.2, 0}, {4.2, 2}, {5, 4}, {2.5, 3.25}, {0, 4}, {0.75, 2}});
    add(area, {{1.5, 1.75}, {1.5, 2.5}, {3.5, 2.25}});
    add(area, {{4.25, 3.3}, {4.25, 3.6}, {4.5, 3.6}, {4.5, 3.3}});
    double size = -0.25 * 0.3;
    const auto twice = [](std::initializer_list<SlabNode> corners) {
        double sum = 0;
        for (auto a = corners.begin(); a != corners.end(); ++a) {
            const SlabNode& b = a + 1 == corners.end() ? *corners.begin() : *(a + 1);
            sum += a->s * b.v - b.s * a->v;
        }
        return sum;
    };
    size += twice({{0, 0.5}, {2.5, 1.5}, {5.2, 0}, {4.2, 2}, {5, 4}, {2.5, 3.25}, {0, 4}, {0.75, 2}}) / 2;
    size += twice({{1.5, 1.75}, {1.5, 2.5}, {3.5, 2.25}}) / 2;
    area.addCrossings();
    check(area, size);
}

TEST_CASE("polygons: chords that enclose nothing are refused", "[cad]") {
    SlabArea area;
    add(area, {{0, 0}, {3, 0}, {3, 1}, {0, 1}});
    area.chords.pop_back();
    area.chords.pop_back();
    Triangles triangles;
    CHECK_FALSE(area.triangulate(triangles));
}

}  // namespace touchstone::polygon_tests
