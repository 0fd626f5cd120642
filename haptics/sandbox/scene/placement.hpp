#pragma once
// Where the nodes of a scene are while it runs.
#include <glm/glm.hpp>

#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// World matrix of a node, in meters: parts of the tool follow the tool pose X_WT (null: as in the file), parts of an
/// obstacle follow its pose in the world.
glm::dmat4 placeOf(const HapticScene& scene, engine::Entity node, const Pose* X_WT);

}  // namespace touchstone::sandbox
