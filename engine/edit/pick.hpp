#pragma once
// Finds the node under the cursor, and the size of a node.
#include <functional>
#include <vector>

#include "engine/scene/components.hpp"
#include "engine/scene/scene.hpp"
#include "engine/view/camera.hpp"

namespace touchstone::engine {

/// World matrix of a node where it is drawn, meters.
using Placement = std::function<glm::dmat4(Entity)>;

/// The node whose visible mesh a ray meets first; null if it misses all. Tests every triangle (5 ns each): call it for
/// a click, not for each frame.
Entity pickNode(const Registry& registry, const Placement& placement, const Ray& ray);

/// Box around the meshes of a node and all below it, in its own frame, meters.
struct NodeBox {
    glm::vec3 low{0}, high{0};
    bool empty = true;  ///< no mesh

    glm::vec3 center() const { return 0.5f * (low + high); }
    /// The eight corners under a matrix; bits 0 to 2 of the index choose high x, y, z.
    std::vector<glm::vec3> corners(const glm::dmat4& matrix) const;
};
NodeBox boxOf(const Registry& registry, Entity node);

}  // namespace touchstone::engine
