#pragma once
// Two gears of involute teeth: one fixed, one that slides down a post into mesh with it.
#include <numbers>

#include "engine/scene/mesh_data.hpp"
#include "tools/parts/planar.hpp"

namespace touchstone::app {

/// Lengths in mm, angles in rad.
struct GearPair {
    double module = 2;  ///< pitch diameter divided by number of teeth
    int fixedTeeth = 21, looseTeeth = 15;
    double pressureAngle = std::numbers::pi / 9;  ///< 20 degrees
    double width = 8;                             ///< of both gears along the axis
    double bore = 10;                             ///< diameter of the loose gear's bore
    double clearance = 0.3;                       ///< on each side of a tooth in mesh, and of the post in the bore
    double chamfer = 1.5;                         ///< 45° around the top of the post
    double spacing = 0.7;                         ///< of the mesh's points

    double distance() const { return module * (fixedTeeth + looseTeeth) / 2; }  ///< of the axes
};

/// Cross-section with a tooth about +x: involute flanks down to the base circle and radial ones below it, tips one
/// module above the pitch circle and roots a module and a quarter below. Flanks are moved inward by half the clearance.
/// Throws std::invalid_argument with one sentence when teeth come to a point or leave no root.
Outline gearProfile(const GearPair& fit, int teeth);

/// The loose gear with its bore, about the y axis, with the origin at half its width.
engine::MeshData looseGear(const GearPair& fit);

/// The fixed gear from y = 0 up to the width; its post is 1.5 times as high plus a chamfer.
engine::MeshData fixedGear(const GearPair& fit);
engine::MeshData gearPost(const GearPair& fit);

/// Angle of the loose gear about y at which a gap faces the fixed gear's tooth, with its axis at x = distance().
double meshAngle(const GearPair& fit);

}  // namespace touchstone::app
