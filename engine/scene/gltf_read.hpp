#pragma once
// Reads .gltf and .glb files (glTF 2.0) into a Scene.
#include <filesystem>

#include "engine/scene/scene.hpp"

namespace touchstone::engine {

/// Reads one scene of a file. `sceneIndex` -1: the file's default scene, else its first one. World transforms are set.
/// Reads triangle geometry, materials, textures and node animations. Instances (EXT_mesh_gpu_instancing) become part of
/// their node's mesh; nodes hidden by KHR_node_visibility become invisible. Ignored features, and broken objects that
/// the scene does not use, are listed in Scene::warnings. Missing normals are computed as area-weighted means. Time is
/// linear in the size of the file. Throws SceneError with one sentence for a file that is not glTF 2.0, is unsafe, is
/// broken where the scene uses it, or requires an unsupported extension.
Scene readGltf(const std::filesystem::path& file, int sceneIndex = -1);

}  // namespace touchstone::engine
