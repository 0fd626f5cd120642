#pragma once
// Reads KHR_physics_rigid_bodies.
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/fields.hpp"
#include "engine/scene/scene.hpp"

namespace touchstone::engine {

/// Component of nodes with a KHR_physics_rigid_bodies collider: its geometry. With neither index, the meshes of the
/// node itself are the geometry.
struct ColliderGeometry {
    int node = -1;  ///< glTF node: the meshes at and below it are used, in its frame
    int mesh = -1;  ///< glTF mesh
};

/// How the coefficients of two materials combine. Of two rules the earlier one holds.
enum class FrictionCombine : std::uint8_t { Average, Minimum, Maximum, Multiply };
inline constexpr std::array kFrictionCombineNames{"average", "minimum", "maximum", "multiply"};

/// The friction of a material of KHR_physics_rigid_bodies; the values are the schema's defaults.
struct FrictionMaterial {
    double staticFriction = 0.6, dynamicFriction = 0.6;
    FrictionCombine combine = FrictionCombine::Average;
    bool complete = false;  ///< the file gives all three
    friend bool operator==(const FrictionMaterial&, const FrictionMaterial&) = default;
};

/// Reads the keys staticFriction, dynamicFriction and frictionCombine. Throws SceneError as Fields does.
FrictionMaterial readFriction(Fields& fields);

/// The coefficient of a pair from those of its materials.
double combined(double a, double b, FrictionCombine combine);

struct RigidBodyMark {
    bool motion = false;                       ///< the node moves as a separate body
    std::optional<FrictionMaterial> friction;  ///< of the collider's material
    bool trigger = false;
    std::optional<ColliderGeometry> collider;
    std::optional<ColliderGeometry> triggerGeometry;
};

/// Reads the extension of a node, in the form of the review draft or the earlier forms with `mesh`. Unsupported
/// features (implicit shapes, hulls) become warnings. Returns nothing if the node does not have the extension. Throws
/// SceneError for wrong types and for invalid indices.
std::optional<RigidBodyMark> readRigidBody(const Scene& scene, Entity node, std::vector<std::string>& warnings);

}  // namespace touchstone::engine
