#pragma once
// Flat keys in extras, such as touchstone_role: modeling programs edit them more easily than nested objects.
#include "engine/scene/scene.hpp"

namespace touchstone::sandbox {

/// Moves the keys `touchstone_KEY` of all nodes, of the animations and of the scene into the object `touchstone`, and
/// `touchstone_goal_KEY` (also gauge, outcome, settings) into that object in it. Only changes the scene in memory.
/// Throws engine::SceneError if a value is given twice.
void nestFlatKeys(engine::Scene& scene);

}  // namespace touchstone::sandbox
