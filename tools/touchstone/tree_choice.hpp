#pragma once
// The sphere tree that the command line asks for.
#include "haptics/builder/tree_builder.hpp"
#include "tools/touchstone/commands.hpp"

namespace touchstone::app {

/// Throws UsageError with one sentence for what does not exist, lies out of range or does not go together.
void checkChoice(const TreeChoice& choice);

/// Changes the options of a scene, or the defaults, by what is chosen. `diagonal`: of the part's bounding box in mm, of
/// which an error in percent is a share. Throws like checkChoice().
TreeOptions withChoice(TreeOptions options, const TreeChoice& choice, double diagonal);

}  // namespace touchstone::app
