#pragma once
// Sphere trees in Touchstone's file format: leaves in order, certificate, checksum. The hierarchy follows from the
// leaves.
#include <cstdint>
#include <filesystem>

#include "haptics/collision/sphere_tree.hpp"

namespace touchstone {

/// Writes to a temporary file and renames it, so a reader sees either the old or the complete new file. `key`
/// identifies what the tree was made from (see treeKey(); 0: unknown). Throws std::runtime_error with one sentence if
/// the file cannot be written.
void saveTree(const SphereTree& tree, const std::filesystem::path& file, std::uint64_t key = 0);

struct TreeFile {
    SphereTree tree;
    std::uint64_t key = 0;
};

/// Reads a saved tree bit for bit. Throws std::invalid_argument with one sentence if the file cannot be read, has
/// another format or version, or is damaged.
TreeFile readTree(const std::filesystem::path& file);

inline SphereTree loadTree(const std::filesystem::path& file) { return readTree(file).tree; }

}  // namespace touchstone
