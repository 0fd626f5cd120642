#pragma once
// Scenes of parts that fit too closely for sphere trees, so that their meshes touch. Their hard motions are case 17,
// there and back at speed; 18, a nut pressed on askew; 19, a peg that is levered in its hole; 20, a walk at random with
// jumps.
#include "tools/parts/scenes.hpp"

namespace touchstone::app {

/// Presses a round peg onto the mouth of its hole beside the axis, slides it in and home, and turns it there.
engine::Scene makePeg(const SceneOptions& options);

/// Presses a nut onto its bolt and turns it five times, until it sits on the plate.
engine::Scene makeNut(const SceneOptions& options);

/// Cases 17 and 20 of a splined fit.
void addSplineCases(engine::Scene& scene, engine::Entity tool, const SplineFit& fit);

}  // namespace touchstone::app
