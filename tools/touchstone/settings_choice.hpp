#pragma once
// The settings of a run: defaults, then the scene's, then the command line's.
#include "haptics/loop/settings.hpp"
#include "tools/touchstone/commands.hpp"

namespace touchstone::app {

/// Changes the settings of a scene by --mode, --solver, --shadow, --tolerance and --rate, then by --set in its order.
/// Throws UsageError with one sentence for a key or value that does not exist.
Settings withCommandLine(Settings settings, const RunOptions& options);
/// The solver, tolerance and mode of `touchstone qp`. Throws likewise.
Settings settingsOf(const QpCommand& command);

}  // namespace touchstone::app
