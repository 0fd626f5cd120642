#pragma once
// The options of a sphere tree on the command line.
#include <cstdint>
#include <optional>
#include <string>

#include "haptics/builder/tree_builder.hpp"
#include "tools/touchstone/commands.hpp"

namespace touchstone::app {

/// Options that are not given keep the value of the scene, or the default.
struct TreeChoice {
    std::optional<int> leaves, levels;  ///< at most one of these two and maxError
    std::string maxError;               ///< as text: 0.02mm, 0.02 or 0.1%
    std::optional<std::string> quality, interior;
    std::optional<std::uint64_t> seed;
    std::optional<int> threads;
};

/// Adds the options that `tree` and `new` share.
void addTreeChoice(CLI::App& command, TreeChoice& choice);

/// Throws UsageError with one sentence for names that do not exist, numbers out of range and options that exclude each
/// other.
void checkChoice(const TreeChoice& choice);

/// Changes the options of a scene, or the defaults, by the choice. `diagonal` of the part's bounding box, mm: an error
/// in percent is relative to it. Throws like checkChoice().
TreeOptions withChoice(TreeOptions options, const TreeChoice& choice, double diagonal);

}  // namespace touchstone::app
