#pragma once
// glTF 2.0 in: .gltf and .glb files into a Scene.
#include <filesystem>

#include "engine/scene/scene.hpp"

namespace touchstone::engine {

/// Reads one scene of a file. `sceneIndex` -1: the file's default scene, else its first one. World transforms are set.
/// Static triangle geometry with base colours, textures and node animations; instances (EXT_mesh_gpu_instancing) become
/// part of their node's mesh, nodes hidden by KHR_node_visibility get Visibility. What is left out, and what is broken
/// but not used by the scene, is named in Scene::warnings. Missing normals are computed smooth, weighted by area. Time
/// is linear in the size of the file. Throws SceneError with one sentence for a file that is no glTF 2.0, is unsafe, is
/// broken where the scene uses it, or requires an unsupported extension.
Scene readGltf(const std::filesystem::path& file, int sceneIndex = -1);

}  // namespace touchstone::engine
