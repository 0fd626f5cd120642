#pragma once
// Scenes of another size.
#include <vector>

#include "engine/edit/scene_edit.hpp"

namespace touchstone::engine {

/// The edits that scale a scene about the origin, with the motion of each root and the lengths that a member of extras
/// has: translations, clearances, deviations, and what stands under keys that end in "_m". Throws SceneError if a root
/// has several motions, or one that scales it.
std::vector<SceneEdit> scaled(const Scene& scene, double scale, const char* member);

}  // namespace touchstone::engine
