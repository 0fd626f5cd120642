#include "tools/parts/drawer.hpp"

#include <cmath>

#include "tools/parts/planar.hpp"
#include "tools/parts/solid.hpp"

namespace touchstone::app {

double DrawerFit::tilt() const {
    return std::asin((width + 2 * clearance) / std::hypot(length, width)) - std::atan2(width, length);
}

double DrawerFit::engaged() const { return length * std::cos(tilt()) - width * std::sin(tilt()); }

engine::MeshData drawer(const DrawerFit& fit) {
    require(fit.length > 0 && fit.width > 0 && fit.height > 0 && fit.clearance > 0 && fit.barDepth > 0,
            "length, width, height and clearance of a drawer and the thickness of its bar must be positive");
    require(2 * fit.wall < fit.width && 2 * fit.wall < fit.length && fit.wall < fit.height && fit.wall > 0,
            "the drawer must be hollow, with a wall on each side");
    require(2 * fit.clearance < fit.length, "the clearance must be less than half the length of the drawer");
    require(fit.neck > fit.recess, "the rails must end before the bar");
    require(fit.bar > fit.width, "the bar must be longer than the drawer is wide");
    // About the middle of drawer and bar.
    const double back = -fit.toMiddle() - fit.length / 2, front = back + fit.length, bar = front + fit.neck,
                 end = bar + fit.barDepth, side = fit.width / 2, half = fit.bar / 2, neck = fit.width / 8,
                 low = -fit.height / 2, floor = low + fit.wall, high = fit.height / 2;
    const Outline outer = subdivided({{back, -side},
                                      {front, -side},
                                      {front, -neck},
                                      {bar, -neck},
                                      {bar, -half},
                                      {end, -half},
                                      {end, half},
                                      {bar, half},
                                      {bar, neck},
                                      {front, neck},
                                      {front, side},
                                      {back, side}},
                                     fit.spacing);
    const double in = fit.wall;
    const Outline inner =
        subdivided({{back + in, in - side}, {front - in, in - side}, {front - in, side - in}, {back + in, side - in}},
                   fit.spacing);
    const Section outside[] = {{low, outer}, {high, outer}}, inside[] = {{high, inner}, {floor, inner}};
    Solid solid;
    addWall(solid, outside, fit.height);
    addWall(solid, inside, fit.height);
    addEnd(solid, high, triangulate(outer, inner, fit.spacing), true);
    addEnd(solid, floor, triangulate(inner, {}, fit.spacing), true);
    addEnd(solid, low, triangulate(outer, {}, fit.spacing), false);
    return finished(solid);
}

}  // namespace touchstone::app
