#pragma once
// Local, world and rigid transforms. Column vectors, metres, as in glTF.
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "engine/scene/components.hpp"
#include "engine/scene/scene.hpp"

namespace touchstone::engine {

/// A matrix as rotation and translation after a linear rest: m = T · R · rest. The rest holds scale, shear and
/// mirroring, and is what gets baked into vertices. The same rest comes out whatever rigid motion is put in front of m.
struct RigidPart {
    glm::dvec3 translation{0};
    glm::dquat rotation{1, 0, 0, 0};
    glm::dmat3 rest{1};
};

/// Splits by Gram-Schmidt on the columns; a mirroring goes into the rest along x. Works for singular matrices too.
RigidPart rigidPart(const glm::dmat4& matrix);

/// The rigid matrix T · R of a part.
glm::dmat4 rigidMatrix(const RigidPart& part);

/// T · R · S · shear.
glm::dmat4 localMatrix(const LocalTransform& local);

/// Inverse of localMatrix() for any affine matrix; what is no product of translation, rotation and scale goes to
/// `shear`.
LocalTransform localTransform(const glm::dmat4& matrix);

/// Writes WorldTransform of every node reachable from the roots. Depth is bounded by memory, not by the call stack.
void updateWorldTransforms(Scene& scene);

/// World matrix of one node, from the local transforms of it and its ancestors.
glm::dmat4 worldMatrix(const Registry& registry, Entity node);

/// Rigid part of the node's WorldTransform.
RigidPart worldPose(const Registry& registry, Entity node);

/// The mesh with the matrix applied to positions and normals; triangles turn over when it mirrors, so that they stay
/// counter-clockwise seen from outside. Normals keep unit length.
MeshData bakedMesh(const MeshData& mesh, const glm::dmat4& matrix);

}  // namespace touchstone::engine
