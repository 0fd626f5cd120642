#pragma once
// Friction of the parts of a scene, and of the pairs of tool and obstacle.
#include <optional>
#include <string>
#include <vector>

#include "haptics/sandbox/scene/role.hpp"
#include "haptics/surface/part.hpp"

namespace touchstone::sandbox {

/// Nodes whose colliders of KHR_physics_rigid_bodies belong to the part, in file order: the part itself, or nodes below
/// it that move with it. Pre: roles are assigned.
std::vector<engine::Entity> collidersOf(const engine::Scene& scene, engine::Entity part);

/// Replaces the friction of tool and obstacles that have a collider by that of the collider's physics material, and
/// appends sentences: to `notes` on defaults, to `warnings` on what has no effect. Pre: roles are assigned, and
/// BodyMarking::friction is that of the extras.
void assignFriction(engine::Scene& scene, const std::vector<engine::Entity>& parts, std::vector<std::string>& notes,
                    std::vector<std::string>& warnings);

/// The part's material; nothing if it is frictionless.
std::optional<Material> materialOf(const BodyMarking& part);
/// As "friction 0.5 at rest, 0.4 sliding, the average of both materials".
std::string frictionWords(const BodyMarking& tool, const BodyMarking& obstacle);

/// Where the part's material is written: `physics material 0 "rubber"`, or the extras of its node.
std::string sourceOf(const engine::Scene& scene, engine::Entity part, const PartFriction& friction);

}  // namespace touchstone::sandbox
