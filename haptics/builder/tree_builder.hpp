#pragma once
// Builds a sphere tree from a surface, by medial balls, a set cover and a certificate.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "haptics/builder/triangle_mesh.hpp"
#include "haptics/collision/sphere_tree.hpp"

namespace touchstone {

enum class TreeQuality : std::uint8_t {
    Fast,  ///< also smooth: large leaves on thick flats protrude less, so that a finger sliding there feels no ripple
    Best,  ///< the least protrusion, about 1.4 times smaller on the bunny; several times slower
};

enum class Interior : std::uint8_t {
    Shell,  ///< leaves cover the surface, for contact from outside
    Solid,  ///< leaves also fill the inside, so that no small tool fits into a hollow between them
};

struct TreeOptions {
    static constexpr int kMaxLeaves = 1 << 18;  ///< largest maximum leaf count that is accepted

    int leaves = 4096;    ///< maximum leaf count, 1 to kMaxLeaves
    double maxError = 0;  ///< mm; if positive, the bound on the protrusion: then `leaves` is ignored
    TreeQuality quality = TreeQuality::Fast;
    Interior interior = Interior::Shell;
    std::uint64_t seed = 1;  ///< random seed: shifts the samples and gives a different tree of equal quality
    int threads = 2;         ///< number of threads; the result does not depend on it

    friend bool operator==(const TreeOptions&, const TreeOptions&) = default;
};

struct BuildStatus {
    double fraction = 0;     ///< completed fraction, 0 to 1
    double secondsLeft = 0;  ///< estimated remaining time; negative while there is no estimate
};

/// Called about every 0.1 s or more often, on the thread that started the build. Returning false cancels the build.
using BuildProgress = std::function<bool(const BuildStatus&)>;

/// Covers the surface with at most `leaves` balls of least protrusion, or with few balls of at most a given protrusion,
/// and orders them into a tree. Leaves are medial balls grown by e, so that none protrudes by more than e. Coverage is
/// proven piece by piece: a ball is convex, so a triangle with three corners inside is inside. The result depends only
/// on the mesh and the options. Throws std::invalid_argument with one sentence if the mesh has no usable triangle or if
/// `maxError` needs more than kMaxLeaves leaves, and BuildCancelled on cancellation.
SphereTree buildSphereTree(const TriangleMesh& mesh, const TreeOptions& options, const BuildProgress& progress = {});

struct BuildCancelled {};

/// Outcome of a cache lookup.
struct CacheReport {
    bool built = false;  ///< the tree was not in the cache and was built
    std::string remark;  ///< one sentence if the entry was damaged or the new one was not written; otherwise empty
};

/// buildSphereTree() with a cache on disk, keyed by mesh and options. A missing, truncated or corrupted entry is
/// rebuilt. An unwritable folder disables the cache and is no failure. Safe for concurrent programs: an entry is
/// written to a temporary file and then renamed, and where several need the same tree, one builds it and the others
/// wait.
SphereTree cachedSphereTree(const TriangleMesh& mesh, const TreeOptions& options, const std::filesystem::path& folder,
                            const BuildProgress& progress = {}, CacheReport* report = nullptr);

/// Hash of everything that a tree depends on: vertices, triangles, options and the builder's version. Stable across
/// runs.
std::uint64_t treeKey(const TriangleMesh& mesh, const TreeOptions& options);

}  // namespace touchstone
