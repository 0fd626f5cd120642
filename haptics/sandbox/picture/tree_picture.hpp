#pragma once
// A sphere tree by itself, as a picture.
#include <filesystem>

#include "haptics/builder/triangle_mesh.hpp"
#include "haptics/collision/sphere_tree.hpp"

namespace touchstone::sandbox {

/// Draws the leaves over the mesh that they are to cover into a PNG file, without display, seen from the front and
/// above (y is up). The mesh is violet, which nothing of a covered surface shows. Throws std::runtime_error with one
/// sentence when there is no OpenGL or the file cannot be written.
void renderTree(const SphereTree& tree, const TriangleMesh& mesh, const std::filesystem::path& file, int width,
                int height);

}  // namespace touchstone::sandbox
