#pragma once
// The device motions of the published experiments, named by their figures.
#include "engine/scene/scene.hpp"
#include "haptics/collision/sphere_tree.hpp"
#include "tools/parts/shapes.hpp"

namespace touchstone::app {

/// `figure-5`: the bunny slides and turns on the other with 50 to 200 pairs of leaves that intersect at the device
/// pose; `figure-5-deeper`: the same path with 200 to 1000. Pre: both bodies have this tree.
void addBunnyFigures(engine::Scene& scene, engine::Entity tool, const SphereTree& tree);

/// `figure-7`: the shaft is pressed on the hole's face, turned until the keys meet the keyways, and pushed in slightly
/// off the axis.
void addSplineFigure(engine::Scene& scene, engine::Entity tool, const SplineFit& fit);

}  // namespace touchstone::app
