#pragma once
// Folders for user files (XDG Base Directory Specification).
#include <filesystem>

namespace touchstone::engine {

/// The folder in the environment variable `own`, else $xdg/touchstone, else $HOME/below/touchstone; empty if none of
/// the variables is set.
std::filesystem::path userFolder(const char* own, const char* xdg, const char* below);

/// The folder of the running program.
std::filesystem::path programFolder();

/// A folder of the program's data: PREFIX/share/touchstone/NAME where the program is installed as
/// PREFIX/bin/touchstone, else `inBuild`.
std::filesystem::path dataFolder(const char* name, const std::filesystem::path& inBuild);

}  // namespace touchstone::engine
