#pragma once
// A picture of a sphere tree.
#include <filesystem>

#include "haptics/builder/triangle_mesh.hpp"
#include "haptics/collision/sphere_tree.hpp"

namespace touchstone::sandbox {

/// Draws the leaves over their mesh into a PNG file, without a display, seen from the front and above (y is up). The
/// mesh is violet, so uncovered surface shows as violet. Throws std::runtime_error with one sentence when there is no
/// OpenGL or the file cannot be written.
void renderTree(const SphereTree& tree, const TriangleMesh& mesh, const std::filesystem::path& file, int width,
                int height);

}  // namespace touchstone::sandbox
