#pragma once
// A drawer with a bar to pull at, in its two guide rails.
#include "engine/scene/mesh_data.hpp"

namespace touchstone::app {

/// Lengths in mm. The drawer slides along x, out of its rails toward +x.
struct DrawerFit {
    double length = 50, width = 40, height = 14;  ///< of the drawer without its bar
    double clearance = 0.3;                       ///< between drawer and rail on each side
    double wall = 3;                              ///< of the drawer
    double recess = 8;                            ///< by which the rails reach beyond both ends of the closed drawer
    double neck = 14;                             ///< from the drawer's front to the bar
    double bar = 120, barDepth = 6;               ///< length of the bar, across the drawer, and its thickness
    double rail = 8;                              ///< thickness of rails and base
    double spacing = 4;                           ///< of the mesh's points

    /// From the middle of the drawer to that of the drawer with its bar.
    double toMiddle() const { return (neck + barDepth) / 2; }
    /// The turn about y at which opposite corners touch the rails, rad.
    double tilt() const;
    /// The distance of those corners along the rails.
    double engaged() const;
};

/// The drawer, an open box, about the middle of drawer and bar.
/// Throws std::invalid_argument with one sentence when the dimensions are impossible.
engine::MeshData drawer(const DrawerFit& fit);

}  // namespace touchstone::app
