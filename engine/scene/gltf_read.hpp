#pragma once
// glTF 2.0 in: .gltf and .glb files into a Scene.
#include <filesystem>

#include "engine/scene/scene.hpp"

namespace touchstone::engine {

/// Reads one scene of a file. `sceneIndex` -1: the file's default scene, else its first one. World transforms are set.
/// Static triangle geometry with base colours, textures and node animations. Other primitive modes, skins and morph
/// targets are left out and named in Scene::warnings. Missing normals are computed smooth, weighted by area.
/// Throws SceneError with one sentence for a file that is broken, unsafe, or asks for an unsupported extension.
Scene readGltf(const std::filesystem::path& file, int sceneIndex = -1);

}  // namespace touchstone::engine
