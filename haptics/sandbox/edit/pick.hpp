#pragma once
// What lies under the cursor, and how large a node is.
#include <optional>
#include <vector>

#include "engine/view/camera.hpp"
#include "haptics/math/rigid.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// World matrix of a node, metres, when the tool's node stands at X_WT (null: where the file has it) and obstacles
/// where the world has them.
glm::dmat4 placeOf(const HapticScene& scene, engine::Entity node, const Pose* X_WT);

/// The node whose visible mesh a ray meets first; null if it misses all. Looks at every triangle (5 ns each): for a
/// click, not for each frame.
engine::Entity pickNode(const HapticScene& scene, const Pose* X_WT, const engine::Ray& ray);

/// Box around the meshes of a node and all below it, in its own frame, metres.
struct NodeBox {
    glm::vec3 low{0}, high{0};
    bool empty = true;  ///< no mesh

    glm::vec3 center() const { return 0.5f * (low + high); }
    /// The eight corners under a matrix; bits 0 to 2 of the index choose high x, y, z.
    std::vector<glm::vec3> corners(const glm::dmat4& matrix) const;
};
NodeBox boxOf(const engine::Registry& registry, engine::Entity node);

}  // namespace touchstone::sandbox
