#pragma once
// A body as spheres: leaves that cover its surface, in an order whose aligned blocks of 8^k leaves are compact.
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "haptics/math/aligned.hpp"
#include "haptics/math/rigid.hpp"

namespace touchstone {

/// A sphere in the body's own frame, mm.
struct Sphere {
    float x = 0, y = 0, z = 0, r = 0;

    Vec3 center() const { return {x, y, z}; }
};

/// What the builder proved of the leaves it placed (see tree_builder.hpp).
struct TreeCertificate {
    double protrusion = 0;  ///< No leaf reaches further than this out of the surface, mm.
    double diagonal = 0;    ///< Of the mesh's bounding box, mm.
    double hollow = -1;     ///< No larger ball fits into the body clear of all leaves, mm; negative: not measured.
    bool covered = false;   ///< Every point of every triangle lies in some leaf (proven by convexity, not sampled).
    bool closed = false;    ///< The mesh bounds a volume; if not, `protrusion` is measured to the sheet itself.
    std::string note;       ///< One sentence for the user where one of these fails; empty otherwise.
};

/// One level of blocks. Block b of level k holds the leaves [b·8^k, (b+1)·8^k). All arrays are padded to a multiple of
/// eight so that eight are tested at once. Padding has no children: a walk that descends masks it out by blocksFrom(),
/// whatever its numbers say. Its coordinates are infinite and its radius is 0, so that no exact gap to it is within
/// anything.
struct TreeLevel {
    int count = 0;                    ///< blocks before padding
    AlignedVector<float> x, y, z, r;  ///< sphere that contains the block's leaf spheres
    /// A rounded box that contains them, too: lo to hi, grown by `round`, the least radius of the block's leaves.
    AlignedVector<float> lo[3], hi[3], round;

    /// Which of the eight from `first` on are blocks, a bit each, lane 0 lowest. Pre: 0 <= first < count.
    std::uint32_t blocksFrom(int first) const { return 0xffu >> std::max(first + 8 - count, 0); }
};

/// Leaves and the implicit hierarchy above them; branching is 8. Immutable once made.
/// levels[0] are the leaves themselves, levels[1] their buckets of eight, levels.back() is one block, the root. Every
/// block's sphere contains all leaf spheres of the block, radii rounded up, so a walk that prunes by it misses no pair.
struct SphereTree {
    static constexpr int kBranching = 8;
    std::vector<TreeLevel> levels;
    TreeCertificate certificate;

    int leafCount() const { return levels.front().count; }
    int nodeCount() const;
    Sphere leaf(int i) const;
    Sphere block(int level, int i) const;
    /// Centre of the root sphere: the tool's reference point C, mm.
    Vec3 center() const;
    /// Greatest distance of a leaf centre from center(), mm: the lever ρ of the travel measure |δp| + ρ|δθ|. O(leaves).
    double reach() const;
};

enum class LeafOrder : std::uint8_t {
    Compact,  ///< to be found
    Given,    ///< as they stand, compact from an earlier tree
};

/// Orders the leaves by median splits with each cut a multiple of the largest 8^k below the count, and bounds every
/// block. Pre: at least one leaf, all finite, radii >= 0. Deterministic.
SphereTree makeSphereTree(std::vector<Sphere> leaves, TreeCertificate certificate = {},
                          LeafOrder order = LeafOrder::Compact);

}  // namespace touchstone
