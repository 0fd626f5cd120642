#pragma once
// EXT_mesh_gpu_instancing: one node that shows its mesh many times.
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "engine/scene/components.hpp"
#include "engine/scene/gltf_accessor.hpp"
#include "engine/scene/warnings.hpp"

namespace touchstone::engine {

/// Number of instances: elements of any of the attributes, whose indices are valid.
std::size_t instanceCount(const nlohmann::json& attributes, const AccessorReader& accessors);

/// The transforms that the attributes TRANSLATION, ROTATION and SCALE give, in the frame of their node. Rotations are
/// normalised, with a warning where that changes them. Throws SceneError naming `node`.
std::vector<glm::dmat4> readInstances(const nlohmann::json& attributes, const AccessorReader& accessors,
                                      const std::string& node, Warnings& warnings);

/// One mesh that holds `mesh` at each of the transforms; as many primitives, each with all the copies of its own.
MeshInstance repeated(const MeshInstance& mesh, const std::vector<glm::dmat4>& transforms);

/// Of unit length to within the rounding of normalised bytes, the limit of the public validator. T: a quaternion, or
/// one as a vector of 4.
template <class T>
bool isUnit(const T& quaternion) {
    constexpr double kTolerance = 0.00769;
    return std::abs(glm::length(quaternion) - 1) <= kTolerance;
}

}  // namespace touchstone::engine
