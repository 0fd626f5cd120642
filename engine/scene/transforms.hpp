#pragma once
// Local, world and rigid transforms. Column vectors and meters, as in glTF.
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "engine/scene/components.hpp"
#include "engine/scene/scene.hpp"

namespace touchstone::engine {

/// A matrix split into translation, rotation and a linear rest: m = T · R · rest. The rest holds scale, shear and
/// mirroring, and is baked into vertices. It does not change if m is multiplied by a rigid motion from the left.
struct RigidPart {
    glm::dvec3 translation{0};
    glm::dquat rotation{1, 0, 0, 0};
    glm::dmat3 rest{1};
};

/// Splits a matrix by Gram-Schmidt on its columns. Mirroring goes into the rest along x. Singular matrices are allowed.
RigidPart rigidPart(const glm::dmat4& matrix);

/// The rigid matrix T · R of a part.
glm::dmat4 rigidMatrix(const RigidPart& part);

/// T · R · S · shear.
glm::dmat4 localMatrix(const LocalTransform& local);

/// Inverse of localMatrix() for any affine matrix. The remainder beyond translation, rotation and scale goes to
/// `shear`.
LocalTransform localTransform(const glm::dmat4& matrix);

/// Updates the WorldTransform of every node below the roots. The depth is limited by memory, not by the call stack.
void updateWorldTransforms(Scene& scene);

/// World matrix of one node, from the local transforms of it and its ancestors.
glm::dmat4 worldMatrix(const Registry& registry, Entity node);

/// Rigid part of the node's WorldTransform.
RigidPart worldPose(const Registry& registry, Entity node);

/// Applies a matrix to the positions and normals of a mesh. If it mirrors, the triangles are flipped, so that they stay
/// counter-clockwise seen from outside. Normals keep unit length.
MeshData bakedMesh(const MeshData& mesh, const glm::dmat4& matrix);

}  // namespace touchstone::engine
