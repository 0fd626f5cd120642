#pragma once
// From a surface to a sphere tree: medial balls, set cover, certificate.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "haptics/builder/triangle_mesh.hpp"
#include "haptics/collision/sphere_tree.hpp"

namespace touchstone {

enum class TreeQuality : std::uint8_t {
    Fast,  ///< and smooth: large leaves on thick flats stand out less, so that a finger sliding there feels no ripple
    Best,  ///< the least protrusion, about 1.4 times tighter on the bunny; several times slower
};

enum class Interior : std::uint8_t {
    Shell,  ///< leaves cover the surface: for touching from outside
    Solid,  ///< and fill the inside, so that no small tool finds a hollow to hide in
};

struct TreeOptions {
    static constexpr int kMostLeaves = 1 << 18;

    int leaves = 4096;    ///< at most this many, 1 to kMostLeaves
    double maxError = 0;  ///< mm; if positive, `leaves` is not read: as few as are found to protrude no further
    TreeQuality quality = TreeQuality::Fast;
    Interior interior = Interior::Shell;
    std::uint64_t seed = 1;  ///< shifts the samples: other trees, equally good
    int threads = 2;         ///< the result does not depend on it

    friend bool operator==(const TreeOptions&, const TreeOptions&) = default;
};

struct BuildStatus {
    double fraction = 0;     ///< done, 0 to 1
    double secondsLeft = 0;  ///< estimate by the clock; negative while there is none
};

/// Called at least every 0.1 s or so by the thread that called; returning false cancels the build.
using BuildProgress = std::function<bool(const BuildStatus&)>;

/// Covers the surface with at most `leaves` balls of least protrusion, or to a given protrusion with few balls, and
/// orders them into a tree. Leaves are medial balls grown by e, so that none sticks out by more than e; coverage is
/// proven piece by piece (a ball is convex: three corners inside mean the triangle is inside). The result depends on
/// mesh, options and nothing else. Throws std::invalid_argument with one sentence when the mesh has no usable triangle
/// or `maxError` asks for more than kMostLeaves, and BuildCancelled on cancel.
SphereTree buildSphereTree(const TriangleMesh& mesh, const TreeOptions& options, const BuildProgress& progress = {});

struct BuildCancelled {};

/// What became of a cache entry.
struct CacheReport {
    bool built = false;  ///< not found there
    std::string remark;  ///< one sentence if the entry was damaged or the new one could not be written; else empty
};

/// buildSphereTree through a cache on disk, keyed by mesh and options. A missing, cut or corrupted entry is rebuilt; an
/// unwritable folder means no cache, not a failure. Safe against two programs at once (written aside, then renamed).
SphereTree cachedSphereTree(const TriangleMesh& mesh, const TreeOptions& options, const std::filesystem::path& folder,
                            const BuildProgress& progress = {}, CacheReport* report = nullptr);

/// Hash of what a tree depends on: vertices, triangles, options, the builder's version. Stable across runs.
std::uint64_t treeKey(const TriangleMesh& mesh, const TreeOptions& options);

}  // namespace touchstone
