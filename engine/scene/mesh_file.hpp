#pragma once
// Parts as STL and OBJ files.
#include <filesystem>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::engine {

/// Reads all triangles of an STL (ASCII or binary) or OBJ file as one mesh, in metres. Vertices at identical
/// coordinates are merged, triangles that are left without three distinct corners dropped, normals computed smooth.
/// Throws SceneError with one sentence when the file cannot be read, is broken, holds non-finite numbers or no
/// triangle.
MeshData readMeshFile(const std::filesystem::path& file, double metresPerUnit);

}  // namespace touchstone::engine
