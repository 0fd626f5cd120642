#pragma once
// Reads KHR_physics_rigid_bodies.
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/scene.hpp"

namespace touchstone::engine {

inline constexpr const char* kRigidBodies = "KHR_physics_rigid_bodies";

/// Component of nodes with a KHR_physics_rigid_bodies collider: its geometry. With neither index, the meshes of the
/// node itself are the geometry.
struct ColliderGeometry {
    int node = -1;  ///< glTF node: the meshes at and below it are used, in its frame
    int mesh = -1;  ///< glTF mesh
};

struct RigidBodyMark {
    bool motion = false;  ///< the node moves as a separate body
    bool trigger = false;
    std::optional<ColliderGeometry> collider;
    std::optional<ColliderGeometry> triggerGeometry;
    std::optional<int> material;  ///< of the collider: index of a physics material
};

/// Reads the extension of a node, in the form of the review draft or the earlier forms with `mesh`. Unsupported
/// features (implicit shapes, hulls) become warnings. Returns nothing if the node does not have the extension. Throws
/// SceneError for wrong types and for invalid indices.
std::optional<RigidBodyMark> readRigidBody(const Scene& scene, Entity node, std::vector<std::string>& warnings);

}  // namespace touchstone::engine
