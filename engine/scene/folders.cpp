#include "engine/scene/folders.hpp"

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

fs::path programFolder() {
    std::error_code error;
    const fs::path program = fs::read_symlink("/proc/self/exe", error);
    return error ? fs::current_path() : program.parent_path();
}

fs::path dataFolder(const char* name, const fs::path& inBuild) {
    std::error_code error;
    fs::path installed = programFolder().parent_path() / "share/touchstone" / name;
    return fs::is_directory(installed, error) ? installed : inBuild;
}

}  // namespace touchstone::engine
