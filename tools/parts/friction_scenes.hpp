#pragma once
// Scenes of friction, whose parts have a physics material. Their hard motion is case 21, a hand that shakes.
#include "tools/parts/scenes.hpp"

namespace touchstone::app {

/// Presses a block onto an inclined plane, as a weight would, and pulls it up, down and up again in short pulls: it
/// sticks, breaks away, slides, and comes to rest.
engine::Scene makeIncline(const SceneOptions& options);
/// Pulls a drawer off its center, where it slides; further off, where it jams; and at its center. `off-center`: the
/// pull that jams alone.
engine::Scene makeDrawer(const SceneOptions& options);

}  // namespace touchstone::app
