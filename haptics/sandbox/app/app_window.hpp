#pragma once
// The window of the program: scene, panels and mouse input for a session.
#include "haptics/sandbox/app/app_options.hpp"

namespace touchstone::sandbox {

/// Opens the window and runs until it is closed or `seconds` have passed. Returns 0, or 1 when `scene` could not be
/// opened. Throws std::runtime_error with one sentence when there is no display or the screenshot cannot be written.
/// Errors of scenes and devices are shown in the window.
int runWindow(const WindowRunOptions& options);

}  // namespace touchstone::sandbox
