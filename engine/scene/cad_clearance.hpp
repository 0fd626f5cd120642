#pragma once
// How far apart the exact surfaces of CAD parts are where one fits into the other.
#include <span>

#include "engine/scene/cad_parts.hpp"

namespace touchstone::engine {

/// Sets the clearance of all faces and shapes. Cylinders, cones and spheres have one if a hole of one part surrounds a
/// shaft of another, on the same axis and at the same height: half the difference of the diameters (for cones, at a
/// right angle to the surface). If no two parts are placed like this, they were modeled apart; then a hole and a shaft
/// match if their radii differ by less than a fiftieth. Surfaces that touch or overlap have no clearance.
void findClearances(std::span<CadAssembly> assemblies);

/// The least clearance between the faces of these parts and those of others; 0 if none has one.
double leastClearance(const CadAssembly& assembly);

}  // namespace touchstone::engine
