#pragma once
// Progress of the commands on the console, and checks before they start.
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/session/message_log.hpp"

namespace touchstone::app {

/// A progress bar with the remaining time on the error stream: on a terminal one line that is overwritten, elsewhere
/// one line for each part. Work of less than half a second shows nothing. `doing` is what happens to each part:
/// "building the sphere tree of". While the bar exists, the first Ctrl-C cancels and the second ends the program.
sandbox::SceneProgress progressBar(const std::string& doing = "building the sphere tree of");

/// The progress of a run with its expected end, for HeadlessOptions::onProgress: on a terminal one line that is
/// overwritten, elsewhere a few lines. A run of a few seconds shows nothing.
std::function<void(double, const std::optional<double>&)> runProgress();

/// Writes what is said of a device to the error stream.
void sayOnConsole(sandbox::Message::Kind kind, const std::string& text);

/// The program as a user in this folder types it: `touchstone` if the PATH finds this very program, else its path.
std::string programAsTyped();

/// The text in lines that end before the terminal's right edge, or after $COLUMNS columns; each but the first is
/// indented. Unchanged if neither is known or wide enough.
std::string wrapped(const std::string& text, std::size_t indent);

/// Throws std::runtime_error with one sentence if there is no display for a window.
void requireDisplay();

/// Throws std::runtime_error if `what` ("the report") cannot be written there.
void requireWritable(const std::filesystem::path& file, const std::string& what);

/// Makes the folder if it does not exist. Throws std::runtime_error if `what` cannot be written there.
void makeFolder(const std::filesystem::path& folder, const std::string& what);

}  // namespace touchstone::app
