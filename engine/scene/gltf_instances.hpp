#pragma once
// EXT_mesh_gpu_instancing: a node that shows its mesh many times.
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "engine/scene/components.hpp"
#include "engine/scene/gltf_accessor.hpp"
#include "engine/scene/warnings.hpp"

namespace touchstone::engine {

/// Number of instances: the count of any attribute. Pre: the accessor indices are valid.
std::size_t instanceCount(const nlohmann::json& attributes, const AccessorReader& accessors);

/// The instance transforms from the attributes TRANSLATION, ROTATION and SCALE, in the frame of their node. Rotations
/// are normalized, with a warning if that changes them. Throws SceneError naming `node`.
std::vector<glm::dmat4> readInstances(const nlohmann::json& attributes, const AccessorReader& accessors,
                                      const std::string& node, Warnings& warnings);

/// One mesh with a copy of `mesh` for each transform. Each primitive holds all its copies.
MeshInstance instancedMesh(const MeshInstance& mesh, const std::vector<glm::dmat4>& transforms);

/// Whether a quaternion has unit length within the rounding of normalized bytes, which is the limit of the public
/// validator. T: a quaternion type or a vector of 4.
template <class T>
bool isUnit(const T& quaternion) {
    constexpr double kTolerance = 0.00769;
    return std::abs(glm::length(quaternion) - 1) <= kTolerance;
}

}  // namespace touchstone::engine
