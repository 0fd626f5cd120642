#pragma once
// What the commands say while they work, and files written whole.
#include <filesystem>
#include <string>

#include "haptics/system/scene_world.hpp"

namespace touchstone::app {

/// A progress bar on the error stream while sphere trees are built; on anything but a terminal one line a part. What
/// takes less than a moment shows nothing.
system::SceneProgress progressBar();

/// Throws std::runtime_error when a file to be called `what` could not be written there.
void requireWritable(const std::filesystem::path& file, const std::string& what);

/// Throws std::runtime_error naming `what` when the file cannot be written.
void writeText(const std::filesystem::path& file, const std::string& what, const std::string& text);

}  // namespace touchstone::app
