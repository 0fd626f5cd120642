#pragma once
// What KHR_physics_rigid_bodies says of a node.
#include <optional>
#include <string>
#include <vector>

#include "haptics/system/roles.hpp"

namespace touchstone::system {

struct RigidBodyMark {
    bool motion = false;  ///< moves as a body of its own
    bool trigger = false;
    std::optional<ColliderGeometry> collider;
    std::optional<ColliderGeometry> triggerGeometry;
};

/// Reads the extension of a node after its review draft, and the earlier forms with `mesh`. What is left out (implicit
/// shapes, hulls) becomes a warning. Nothing when the node does not have the extension.
/// Throws engine::SceneError for wrong types and for indices that the file does not have.
std::optional<RigidBodyMark> readRigidBody(const engine::Scene& scene, engine::Entity node,
                                           std::vector<std::string>& warnings);

/// One sentence about the friction of the file's physics materials, which is not simulated; empty without any.
std::string frictionWarning(const engine::Scene& scene);

}  // namespace touchstone::system
