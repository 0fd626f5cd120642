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
    require(fit.clearance >= 0 && fit.chamfer > 0, "a peg needs a chamfer, and no negative clearance");
    require(fit.chamfer < std::min({fit.length, fit.depth, fit.diameter / 2, fit.wall}),
            "the chamfer must be smaller than length, depth, radius and wall");
    require(fit.segments >= 8 && fit.holeSides() >= 8, "peg and hole need eight segments or more");
}

}  // namespace

engine::MeshData peg(const PegFit& fit) {
    check(fit);
    const double radius = fit.diameter / 2;
    const Outline tip = polygon(radius - fit.chamfer, fit.segments), round = polygon(radius, fit.segments);
    const Section sections[] = {{0, tip}, {fit.chamfer, round}, {fit.length, round}};
    Solid solid;
    addWall(solid, sections, fit.length);
    addEnd(solid, fit.length, triangulate(round, {}, fit.spacing), true);
    addEnd(solid, 0, triangulate(tip, {}, fit.spacing), false);
    return finished(solid);
}

engine::MeshData pegHole(const PegFit& fit) {
    check(fit);
    const int sides = fit.holeSides();
    const double radius = (fit.diameter / 2 + fit.clearance) / std::cos(kPi / sides);
    const Outline bore = polygon(radius, sides), mouth = polygon(radius + fit.chamfer, sides);
    const Outline outer = circle(radius + fit.wall, kChordError, fit.spacing);
    const Section outside[] = {{-fit.depth - fit.wall, outer}, {0, outer}};
    const Section within[] = {{0, mouth}, {-fit.chamfer, bore}, {-fit.depth, bore}};
    Solid solid;
    addWall(solid, outside, fit.depth + fit.wall);
    addWall(solid, within, fit.depth);
    addEnd(solid, 0, triangulate(outer, mouth, fit.spacing), true);
    addEnd(solid, -fit.depth, triangulate(bore, {}, fit.spacing), true);
    addEnd(solid, -fit.depth - fit.wall, triangulate(outer, {}, fit.spacing), false);
    return finished(solid);
}

}  // namespace touchstone::app
