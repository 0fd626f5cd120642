#pragma once
// A cap with lugs and the holder that it is put into, turned in, and drawn back to lock.
#include <numbers>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::app {

/// Lengths in mm, angles in rad. Slots like a J go through the holder's wall: down from its rim, clockwise round (seen
/// from above), and up again into a pocket. Lugs and slots have parallel flanks.
struct BayonetFit {
    double diameter = 22;  ///< of the cap's body
    int lugs = 3;
    double lugWidth = 4, lugHeight = 3, lugReach = 3;  ///< round the axis, along it, and out of the body
    double depth = 8;                                  ///< from the rim to the middle of a lug that rests in the slot
    double turn = std::numbers::pi / 3;                ///< from where lugs go in to where the pockets are
    double rise = 2;                                   ///< of a pocket above the way round
    double clearance = 0.3;                            ///< on each side of lugs and body
    double spacing = 1;                                ///< of the mesh's points

    /// Height of the lugs' middle when they are drawn up in their pockets; the rim is at 0.
    double locked() const { return -depth + rise + 2 * clearance; }
};

/// About the y axis, one lug at +x, the middle of the lugs at y = 0, the grip above.
/// Throws std::invalid_argument with one sentence when slots would meet each other or the rim.
engine::MeshData bayonetCap(const BayonetFit& fit);

/// Its rim in the plane y = 0; lugs at +x go straight in.
engine::MeshData bayonetHolder(const BayonetFit& fit);

}  // namespace touchstone::app
