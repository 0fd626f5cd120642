#pragma once
// touchstone tree check, a command below `touchstone tree`.
#include "tools/touchstone/commands.hpp"

namespace touchstone::app {

/// Adds it below `tree` and returns it.
const CLI::App* addTreeCheck(CLI::App& tree, Action& action);

}  // namespace touchstone::app
