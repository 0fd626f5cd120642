#pragma once
// Closed solids as triangle meshes: the parts of the scenes.
// Parameters are in mm, as in drawings; meshes are in meters, as MeshData says. Every mesh is watertight by exact
// positions, counter-clockwise seen from outside, with flat normals at edges sharper than 30 degrees and smooth ones
// elsewhere. Curved faces are inscribed: their vertices lie on the surface, their chords at most kChordError inside it.
#include "engine/scene/mesh_data.hpp"
#include "tools/parts/planar.hpp"

namespace touchstone::app {

inline constexpr double kChordError = 0.02;  ///< mm

/// Box about the origin with faces divided into squares of at most `spacing`.
engine::MeshData box(const glm::dvec3& size, double spacing);

/// Sphere about the origin: an icosahedron divided until its chords are at most kChordError inside.
engine::MeshData sphere(double radius);

/// A sphere about the origin, some 60 mm across, with smooth bumps and hollows of its own for each seed, and with the
/// multiple of 12 nearest to this number of triangles whose twelfth is a square.
engine::MeshData pebble(int triangles, unsigned seed);

/// Cylinder about the origin along y with flat ends.
engine::MeshData cylinder(double radius, double length, double spacing);

/// A splined shaft and the hole it fits. The profile has straight-sided keys on a root circle; in the hole the same
/// profile is offset outward by `clearance` everywhere: on key tops, roots and flanks alike, along the face normal.
struct SplineFit {
    double diameter = 30;  ///< over the keys of the shaft
    int keys = 8;
    double keyDepth = 3;     ///< from root circle to key top
    double keyWidth = 5;     ///< between the parallel flanks
    double length = 40;      ///< of the shaft
    double clearance = 0.5;  ///< between the surfaces, on each side
    double chamfer = 0;      ///< 45° on the shaft's lower end and around the hole's mouth
    double depth = 36;       ///< of the hole
    double wall = 5;         ///< around the hole and, if it is blind, below it
    bool blind = true;       ///< false: the hole goes through a sleeve of height `depth`
    double spacing = 1;      ///< of the mesh's points along edges and faces
};

/// Cross-section of the shaft: key tops and roots inscribed in their circles, first key about +x.
/// Throws std::invalid_argument with one sentence when keys overlap or leave no core.
Outline splineProfile(const SplineFit& fit);

/// The shaft along y, from y = 0 (the end that goes in first) up to y = length.
engine::MeshData splinedShaft(const SplineFit& fit);

/// The hole in a cylinder along y: its mouth in the plane y = 0, its bottom at y = -depth.
engine::MeshData splinedHole(const SplineFit& fit);

}  // namespace touchstone::app
