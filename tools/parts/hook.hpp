#pragma once
// A hook and the eye that holds it, of round wire.
#include "engine/scene/mesh_data.hpp"

namespace touchstone::app {

/// Lengths in mm; radii of bow and eye to the middle of the wire.
struct HookAndEye {
    double wire = 5;     ///< thickness of both
    double bow = 9;      ///< radius of the hook's bend
    double eye = 13;     ///< radius of the ring
    double shank = 40;   ///< from the middle of the bow to the hook's end
    double tip = 2;      ///< of the hook, straight up beyond the bow
    double spacing = 1;  ///< of the mesh's points

    /// Height of the bow's middle above the ring's when the hook is pulled up against the ring.
    double hung() const { return eye + bow - wire; }
};

/// The hook in the xy plane, the middle of the bow at the origin, the tip at -x, the shank above the origin.
/// Throws std::invalid_argument with one sentence when the wire is too thick for its bends.
engine::MeshData hook(const HookAndEye& fit);

/// A ring about the x axis and the origin, on a stem that reaches 1.5 radii down from its lower edge.
engine::MeshData eyeRing(const HookAndEye& fit);
engine::MeshData eyeStem(const HookAndEye& fit);

}  // namespace touchstone::app
