#pragma once
// What KHR_physics_rigid_bodies says of a node.
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/scene.hpp"

namespace touchstone::engine {

/// Component of nodes with a KHR_physics_rigid_bodies collider: where its geometry stands. With neither index the
/// meshes of the node itself are meant.
struct ColliderGeometry {
    int node = -1;  ///< glTF node, whose meshes and those below it are taken, in its own frame
    int mesh = -1;  ///< glTF mesh
};

struct RigidBodyMark {
    bool motion = false;  ///< moves as a body of its own
    bool trigger = false;
    std::optional<ColliderGeometry> collider;
    std::optional<ColliderGeometry> triggerGeometry;
};

/// Reads the extension of a node after its review draft, and the earlier forms with `mesh`. What is left out (implicit
/// shapes, hulls) becomes a warning. Nothing when the node does not have the extension.
/// Throws SceneError for wrong types and for indices that the file does not have.
std::optional<RigidBodyMark> readRigidBody(const Scene& scene, Entity node, std::vector<std::string>& warnings);

/// One sentence about the friction of the file's physics materials, which is not simulated; empty without any.
std::string frictionWarning(const Scene& scene);

}  // namespace touchstone::engine
