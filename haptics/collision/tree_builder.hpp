#pragma once
// From a surface to a sphere tree: medial balls, set cover, certificate.
#include <cstdint>
#include <filesystem>
#include <functional>

#include "haptics/collision/sphere_tree.hpp"
#include "haptics/collision/triangle_mesh.hpp"

namespace touchstone {

struct TreeOptions {
    int leaves = 4096;  ///< at most this many
    std::uint64_t seed = 1;
};

/// Called with the fraction done, 0 to 1; returning false cancels the build.
using BuildProgress = std::function<bool(double)>;

/// Covers the surface with at most `leaves` balls of least protrusion and orders them into a tree.
/// Leaves are medial balls grown by e, so that none sticks out by more than e; coverage is proven piece by piece (a
/// ball is convex: three corners inside mean the triangle is inside). The result depends on mesh, options and nothing
/// else. Throws std::invalid_argument with one sentence when the mesh has no usable triangle, and BuildCancelled on
/// cancel.
SphereTree buildSphereTree(const TriangleMesh& mesh, const TreeOptions& options, const BuildProgress& progress = {});

struct BuildCancelled {};

/// buildSphereTree through a cache on disk, keyed by mesh and options. A missing, cut or corrupted entry is rebuilt; an
/// unwritable folder means no cache, not a failure. Safe against two programs at once (written aside, then renamed).
SphereTree cachedSphereTree(const TriangleMesh& mesh, const TreeOptions& options, const std::filesystem::path& folder,
                            const BuildProgress& progress = {});

/// Hash of what a tree depends on: vertices, triangles, options. Stable across runs.
std::uint64_t treeKey(const TriangleMesh& mesh, const TreeOptions& options);

}  // namespace touchstone
