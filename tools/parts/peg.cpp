#include "tools/parts/peg.hpp"

#include <algorithm>
#include <cmath>

#include "tools/parts/angles.hpp"
#include "tools/parts/shapes.hpp"
#include "tools/parts/solid.hpp"

namespace touchstone::app {
namespace {

void check(const PegFit& fit) {
    require(fit.diameter > 0 && fit.length > 0 && fit.depth > 0 && fit.wall > 0,
            "diameter, length, depth and wall of a peg must be positive");
    require(fit.clearance >= 0 && fit.chamfer >= 0 && fit.breadth >= 0,
            "clearance, chamfer and breadth of a peg must not be negative");
    require(
        fit.chamfer < std::min({fit.length, fit.depth, (fit.breadth > 0 ? fit.breadth : fit.diameter) / 2, fit.wall}),
        "the chamfer must be smaller than length, depth, wall and half the width");
    require(fit.segments >= 8 && fit.holeSides() >= 8, "peg and hole need eight segments or more");
}

/// The rectangle of the peg, moved outward.
Outline rectangle(const PegFit& fit, double outward) {
    const glm::dvec2 half(fit.diameter / 2, fit.breadth / 2);
    const Outline corners{{-half.x, -half.y}, {half.x, -half.y}, half, {-half.x, half.y}};
    return offset(subdivided(corners, fit.spacing), outward);
}

/// Drops sections that repeat a height, as those of a chamfer of length zero do.
std::vector<Section> distinct(std::vector<Section> sections) {
    const auto same = [](const Section& a, const Section& b) { return a.y == b.y; };
    sections.erase(std::unique(sections.begin(), sections.end(), same), sections.end());
    return sections;
}

}  // namespace

engine::MeshData peg(const PegFit& fit) {
    check(fit);
    const auto outline = [&](double outward) {
        return fit.breadth > 0 ? rectangle(fit, outward) : polygon(fit.diameter / 2 + outward, fit.segments);
    };
    const Outline tip = outline(-fit.chamfer), whole = outline(0);
    Solid solid;
    addWall(solid, distinct({{0, tip}, {fit.chamfer, whole}, {fit.length, whole}}), fit.length);
    addEnd(solid, fit.length, triangulate(whole, {}, fit.spacing), true);
    addEnd(solid, 0, triangulate(tip, {}, fit.spacing), false);
    return finished(solid);
}

engine::MeshData pegHole(const PegFit& fit) {
    check(fit);
    const int sides = fit.holeSides();
    const double radius = (fit.diameter / 2 + fit.clearance) / std::cos(kPi / sides);
    const auto outline = [&](double outward) {
        return fit.breadth > 0 ? rectangle(fit, fit.clearance + outward) : polygon(radius + outward, sides);
    };
    const double reach = fit.breadth > 0 ? std::hypot(fit.diameter, fit.breadth) / 2 + fit.clearance : radius;
    const Outline bore = outline(0), mouth = outline(fit.chamfer);
    const Outline outer = circle(reach + fit.wall, kChordError, fit.spacing);
    const double under = fit.through ? -fit.depth : -fit.depth - fit.wall;
    const Section outside[] = {{under, outer}, {0, outer}};
    Solid solid;
    addWall(solid, outside, -under);
    addWall(solid, distinct({{0, mouth}, {-fit.chamfer, bore}, {-fit.depth, bore}}), fit.depth);
    addEnd(solid, 0, triangulate(outer, mouth, fit.spacing), true);
    if (!fit.through) addEnd(solid, -fit.depth, triangulate(bore, {}, fit.spacing), true);
    addEnd(solid, under, triangulate(outer, fit.through ? bore : Outline{}, fit.spacing), false);
    return finished(solid);
}

}  // namespace touchstone::app
