#pragma once
// Sphere trees as files of our own: leaves in order, certificate, checksum. The hierarchy follows from the leaves.
#include <cstdint>
#include <filesystem>

#include "haptics/collision/sphere_tree.hpp"

namespace touchstone {

/// Writes beside the file, then renames: a reader sees the old file or the new one, whole. `key` tells what the tree
/// was made from (treeKey(); 0: not told). Throws std::runtime_error with one sentence when it cannot be written.
void saveTree(const SphereTree& tree, const std::filesystem::path& file, std::uint64_t key = 0);

struct TreeFile {
    SphereTree tree;
    std::uint64_t key = 0;
};

/// Gives the saved tree back to the bit. Throws std::invalid_argument with one sentence when the file cannot be read,
/// is of another kind or version, or is damaged.
TreeFile readTree(const std::filesystem::path& file);

inline SphereTree loadTree(const std::filesystem::path& file) { return readTree(file).tree; }

}  // namespace touchstone
