#pragma once
// A tooth in its gum, with a pocket between them, and the probe that measures how deep it is.
// Parameters are in mm; the tooth stands along +y, the gum margin at its highest is y = 0, the pocket is at +x.
#include <array>

#include "engine/scene/mesh_data.hpp"
#include "engine/scene/scene.hpp"

namespace touchstone::app {

struct SceneOptions;

/// The gap between tooth and gum: `sulcus` deep all around, and deeper at the pocket. Its walls taper from `width` at
/// the margin to `bottomWidth` at the flat bottom.
struct PocketFit {
    double depth = 2;          ///< of the pocket, from the margin to its bottom along y
    double sulcus = 1;         ///< of the gap elsewhere; the depth changes smoothly in between
    double width = 0.8;        ///< at the margin, normal to the tooth in a horizontal plane
    double bottomWidth = 0.6;  ///< at the bottom; must leave room for the probe's tip
    double stiffness = 1000;   ///< N/m of the spring between hand and probe
};

inline constexpr double kTipRadius = 0.25;  ///< of the probe, which ends in a half sphere

/// Crown and root of a premolar, closed and smooth.
engine::MeshData tooth();

/// A collar of gum around the tooth: closed, its inner side a little inside the tooth below the gap.
/// Throws std::invalid_argument with one sentence when the dimensions leave no pocket that the probe fits into.
engine::MeshData gum(const PocketFit& fit);

/// The probe from its tip at the origin up along +y, its shank bent toward +x: the bare metal and the black marks. The
/// marks are a line at each mm and the bands 4 to 5, 9 to 10 and 14 to 15 mm. The two meshes together are closed.
std::array<engine::MeshData, 2> periodontalProbe();

/// The probe slides down the tooth, walks along the gap to the pocket, enters it, bottoms out and leaves.
engine::Scene makeDental(const SceneOptions& options);

}  // namespace touchstone::app
