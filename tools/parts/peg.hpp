#pragma once
// A round or rectangular peg and the hole that it fits as a shaft fits its bearing: with a hundredth of a millimeter of
// play.
#include "engine/scene/mesh_data.hpp"

namespace touchstone::app {

/// Lengths in mm. The peg's cross-section is inscribed in its circle, and the hole's is circumscribed about a circle
/// that is larger by the clearance. So no turn brings coaxial walls nearer than the clearance, and they are as near
/// where a corner of the peg faces the middle of a side of the hole: with the default counts at any turn, to 4e-7 mm.
struct PegFit {
    double diameter = 20;     ///< of the peg
    double breadth = 0;       ///< of a rectangular peg, whose other side is the diameter; 0: a round one
    double clearance = 0.01;  ///< least distance of the walls on each side
    double length = 45;       ///< of the peg
    double depth = 30;        ///< of the hole
    double chamfer = 1;       ///< 45° on the peg's lower end and around the hole's mouth
    double wall = 8;          ///< around and below the hole
    double spacing = 2;       ///< of the points of flat ends; walls have one row of faces
    bool through = false;     ///< the hole has no bottom
    int segments = 360;       ///< sides of the peg
    int holeSegments = 0;     ///< sides of the hole; 0: twelve more than the peg has

    int holeSides() const { return holeSegments ? holeSegments : segments + 12; }
};

/// The peg along y, from y = 0 (the end that goes in first) up to y = length.
/// Throws std::invalid_argument with one sentence when the dimensions are impossible.
engine::MeshData peg(const PegFit& fit);

/// The hole in a cylinder along y: its mouth in the plane y = 0, its bottom at y = -depth.
engine::MeshData pegHole(const PegFit& fit);

}  // namespace touchstone::app
