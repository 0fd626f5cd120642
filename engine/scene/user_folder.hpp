#pragma once
// Where the files of a user belong (XDG Base Directory Specification).
#include <filesystem>

namespace touchstone::engine {

/// The folder that the variable `own` names, else touchstone below the one of the variable `xdg`, else below `below` in
/// the home folder; empty when none of them is set.
std::filesystem::path userFolder(const char* own, const char* xdg, const char* below);

}  // namespace touchstone::engine
