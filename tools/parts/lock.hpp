#pragma once
// A key with a notched bit, and a lock whose ward allows it to turn only when it is fully inserted.
#include <numbers>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::app {

/// Lengths in mm, angles in rad. The bit is a flat plate on the key's stem, with a notch in its outer edge. Behind the
/// lock's plate it can turn clockwise (seen from the plate) except for a ward: a rib that only the notch clears.
struct LockFit {
    double stem = 8;       ///< diameter
    double bitReach = 11;  ///< from the axis
    double bitWidth = 3;   ///< between its parallel faces
    double bitLength = 9;  ///< along the axis
    double wardReach = 7;  ///< from the axis to the bottom of the notch
    double wardWidth = 2;  ///< along the axis
    double plate = 4;      ///< thickness that the keyhole goes through
    double pilot = 3;      ///< of the stem beyond the bit
    double turn = std::numbers::pi / 2;
    double clearance = 0.3;  ///< on each side
    double spacing = 1;      ///< of the mesh's points

    double play() const { return 2 * clearance; }  ///< along the axis
    /// Height of the bit's middle when the key is fully inserted; the plate's face is at 0.
    double home() const { return -plate - play() - bitLength / 2; }
};

/// The key about the y axis, the bit at +x with its middle at y = 0, the bow above.
/// Throws std::invalid_argument with one sentence when the dimensions leave no material for bit or ward.
engine::MeshData key(const LockFit& fit);

/// The lock with its face in the plane y = 0, the slot of the keyhole at +x.
engine::MeshData lock(const LockFit& fit);

}  // namespace touchstone::app
