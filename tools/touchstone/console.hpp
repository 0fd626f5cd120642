#pragma once
// What the commands say while they work, and checks before they begin.
#include <filesystem>
#include <string>

#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::app {

/// A progress bar with the time left on the error stream, one line drawn over; on anything but a terminal one line a
/// part. What takes less than a moment shows nothing. `doing` is what happens to each part: "building the sphere tree
/// of". While it lives the first Ctrl-C cancels, the second ends the program.
sandbox::SceneProgress progressBar(const std::string& doing = "building the sphere tree of");

/// Throws std::runtime_error with one sentence when there is no display for a window.
void requireDisplay();

/// Throws std::runtime_error when `what` ("the report") could not be written there.
void requireWritable(const std::filesystem::path& file, const std::string& what);

/// Makes the folder if it is not there. Throws std::runtime_error when `what` could not be written there.
void makeFolder(const std::filesystem::path& folder, const std::string& what);

}  // namespace touchstone::app
