#include "engine/scene/user_folder.hpp"

#include <cstdlib>

namespace touchstone::engine {

namespace fs = std::filesystem;

fs::path userFolder(const char* own, const char* xdg, const char* below) {
    const auto variable = [](const char* name) -> fs::path {
        const char* value = std::getenv(name);
        return value ? value : "";
    };
    if (const auto folder = variable(own); !folder.empty()) return folder;
    // The XDG specification requires that relative paths are ignored.
    if (const auto base = variable(xdg); base.is_absolute()) return base / "touchstone";
    if (const auto home = variable("HOME"); home.is_absolute()) return home / below / "touchstone";
    return {};
}

}  // namespace touchstone::engine
