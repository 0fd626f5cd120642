#pragma once
// Sphere trees of other programs: every node stores its sphere.
#include <filesystem>
#include <vector>

#include "haptics/collision/sphere_tree.hpp"

namespace touchstone {

struct SphereNode {
    Vec3 center = Vec3::Zero();
    double radius = 0;
    int parent = -1;                   ///< -1 for the root
    int firstChild = 0, children = 0;  ///< children are contiguous; a node without children is a leaf
};

/// A tree of spheres without guarantees: parents need not contain their children. The root is first, then level by
/// level.
struct SphereHierarchy {
    int branching = 8;
    std::vector<SphereNode> nodes;

    /// The leaves in order. Radii are enlarged to make up for the rounding to single precision.
    std::vector<Sphere> leaves() const;
};

SphereHierarchy hierarchyOf(const SphereTree& tree);

/// Reads the text format of the common sphere-tree toolkit. Its first line is "levels branching", where the levels
/// include the root. Then there is a line "x y z r importance" for each slot in level order; a negative radius marks an
/// unused slot. Lengths are multiplied by `mmPerUnit`. Throws std::invalid_argument with one sentence that names file
/// and line.
SphereHierarchy readSph(const std::filesystem::path& file, double mmPerUnit = 1);

/// Writes this format. Every number has enough digits to be read back bit for bit. Lengths are divided by `mmPerUnit`.
/// Throws std::runtime_error with one sentence if the file cannot be written; no partial file remains then.
void writeSph(const SphereHierarchy& hierarchy, const std::filesystem::path& file, double mmPerUnit = 1);

}  // namespace touchstone
