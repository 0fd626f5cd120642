#pragma once
// Sphere trees as other programs make and read them: every node has a sphere of its own.
#include <filesystem>
#include <vector>

#include "haptics/collision/sphere_tree.hpp"

namespace touchstone {

struct SphereNode {
    Vec3 center = Vec3::Zero();
    double radius = 0;
    int parent = -1;                   ///< -1: the root
    int firstChild = 0, children = 0;  ///< children stand side by side; none: a leaf
};

/// A tree of spheres that promises nothing: parents need not contain their children. Root first, then level by level.
struct SphereHierarchy {
    int branching = 8;
    std::vector<SphereNode> nodes;

    std::vector<Sphere> leaves() const;  ///< in order, radii rounded up where single precision asks for it
};

SphereHierarchy hierarchyOf(const SphereTree& tree);

/// Reads the text form of the common sphere-tree toolkit: "levels branching", levels counting the root, then a line
/// "x y z r importance" for each slot in level order; a negative radius marks an unused slot. Lengths are multiplied by
/// `mmPerUnit`. Throws std::invalid_argument with one sentence naming file and line.
SphereHierarchy readSph(const std::filesystem::path& file, double mmPerUnit = 1);

/// Writes that form, every number with the digits that give it back to the bit, lengths divided by `mmPerUnit`. Throws
/// std::runtime_error with one sentence when the file cannot be written; then nothing is left of it.
void writeSph(const SphereHierarchy& hierarchy, const std::filesystem::path& file, double mmPerUnit = 1);

}  // namespace touchstone
