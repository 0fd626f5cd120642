#pragma once
// A cap with lugs and its holder: the cap is inserted, turned and drawn back to lock.
#include <numbers>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::app {

/// Lengths in mm, angles in rad. J-shaped slots go through the holder's wall: down from its rim, clockwise around the
/// axis (seen from above), and up again into a pocket. Lugs and slots have parallel flanks.
struct BayonetFit {
    double diameter = 22;  ///< of the cap's body
    int lugs = 3;
    double lugWidth = 4, lugHeight = 3, lugReach = 3;  ///< around the axis, along it, and radially out of the body
    double depth = 8;                                  ///< from the rim to the middle of a lug that rests in the slot
    double turn = std::numbers::pi / 3;                ///< from the entry of the lugs to the pockets
    double rise = 2;                                   ///< of a pocket above the horizontal part of the slot
    double clearance = 0.3;                            ///< on each side of lugs and body
    double spacing = 1;                                ///< of the mesh's points

    /// Height of the lugs' middle when they are in their pockets; the rim is at 0.
    double locked() const { return -depth + rise + 2 * clearance; }
};

/// The cap about the y axis, one lug at +x, the middle of the lugs at y = 0, the grip above.
/// Throws std::invalid_argument with one sentence when slots would meet each other or the rim.
engine::MeshData bayonetCap(const BayonetFit& fit);

/// The holder with its rim in the plane y = 0; a lug at +x enters straight.
engine::MeshData bayonetHolder(const BayonetFit& fit);

}  // namespace touchstone::app
