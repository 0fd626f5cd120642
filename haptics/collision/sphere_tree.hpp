#pragma once
// A body as a tree of spheres: leaves that cover its surface, ordered so that aligned blocks of 8^k leaves are compact.
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

/// What the builder proved about the leaves that it placed (see tree_builder.hpp).
struct TreeCertificate {
    double protrusion = 0;  ///< No leaf extends further than this beyond the surface, mm.
    double diagonal = 0;    ///< Diagonal of the mesh's bounding box, mm.
    double hollow =
        -1;  ///< Radius of the largest ball inside the body that is clear of all leaves, mm; < 0: not measured.
    bool covered = false;  ///< Every point of every triangle lies in some leaf (proven by convexity, not sampled).
    bool closed = false;   ///< The mesh bounds a volume; if not, `protrusion` is measured from the surface itself.
    std::string note;      ///< One sentence for the user if one of these does not hold; empty otherwise.
};

/// One level of blocks. Block b of level k holds the leaves [b·8^k, (b+1)·8^k). All arrays are padded to a multiple of
/// eight so that eight blocks are tested at once. The padding has no children; a walk masks it out with blocksFrom()
/// before it descends. Its coordinates are infinite and its radius is 0, so that no exact gap to it is finite.
struct TreeLevel {
    int count = 0;                    ///< blocks without the padding
    AlignedVector<float> x, y, z, r;  ///< a sphere that contains the block's leaf spheres
    /// A rounded box that also contains them: lo to hi, grown by `round`, the smallest radius of the block's leaves.
    AlignedVector<float> lo[3], hi[3], round;

    /// A mask of those of the eight positions from `first` that are blocks, lane 0 lowest. Pre: 0 <= first < count.
    std::uint32_t blocksFrom(int first) const { return 0xffu >> std::max(first + 8 - count, 0); }
};

/// The leaves and the implicit hierarchy above them with eight children a block. Immutable once made. levels[0] holds
/// the leaves, levels[1] their buckets of eight, and levels.back() one block, the root. The sphere of a block contains
/// all its leaf spheres, with radii rounded up, so a walk that prunes by it misses no pair.
struct SphereTree {
    /// Children of a block: the number of SIMD lanes, so that one instruction tests all of them.
    static constexpr int kBranching = 8;
    std::vector<TreeLevel> levels;
    TreeCertificate certificate;

    int leafCount() const { return levels.front().count; }
    int nodeCount() const;
    Sphere leaf(int i) const;
    Sphere block(int level, int i) const;
    /// Center of the root sphere: the tool's reference point C, mm.
    Vec3 center() const;
    /// Greatest distance of a leaf center from center(), mm: the lever ρ of the travel measure |δp| + ρ|δθ|. O(leaves).
    double reach() const;
};

enum class LeafOrder : std::uint8_t {
    Compact,  ///< makeSphereTree() finds a compact order
    Given,    ///< the leaves keep their order, which is compact because it comes from an earlier tree
};

/// Orders the leaves by median splits, in which each cut is a multiple of the largest 8^k below the count, and computes
/// the bounds of every block. Pre: at least one leaf, all finite, radii >= 0. The result is bit-reproducible.
SphereTree makeSphereTree(std::vector<Sphere> leaves, TreeCertificate certificate = {},
                          LeafOrder order = LeafOrder::Compact);

}  // namespace touchstone
