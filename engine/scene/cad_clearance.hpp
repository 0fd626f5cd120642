#pragma once
// How far apart the exact surfaces of CAD parts are where one fits into the other.
#include <span>

#include "engine/scene/cad_parts.hpp"

namespace touchstone::engine {

/// Sets the clearance of all faces and shapes: of cylinders, cones and spheres, each a hole of one part about a shaft
/// of another, on the same axis and at the same height, half the difference of their diameters (of cones, at a right
/// angle to the surface). Parts of which no two are together so are taken as modeled apart: then a hole and a shaft
/// whose radii differ by less than a fiftieth count. Surfaces that touch or overlap have no clearance.
void findClearances(std::span<CadAssembly> assemblies);

/// The least clearance between the faces of these parts and those of others; 0 if none has one.
double leastClearance(const CadAssembly& assembly);

}  // namespace touchstone::engine
