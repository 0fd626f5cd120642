#pragma once
// Where the bodies of a scene are while it runs.
#include <glm/glm.hpp>

#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// World matrix of a node, metres: the tool's parts follow the tool node at X_WT (null: as in the file), an obstacle's
/// parts follow its pose in the world.
glm::dmat4 placeOf(const HapticScene& scene, engine::Entity node, const Pose* X_WT);

}  // namespace touchstone::sandbox
