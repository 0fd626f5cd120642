#pragma once
// Folders for user files (XDG Base Directory Specification).
#include <filesystem>

namespace touchstone::engine {

/// The folder in the environment variable `own`, else $xdg/touchstone, else $HOME/below/touchstone; empty if none of
/// the variables is set.
std::filesystem::path userFolder(const char* own, const char* xdg, const char* below);

}  // namespace touchstone::engine
