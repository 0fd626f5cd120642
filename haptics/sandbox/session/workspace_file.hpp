#pragma once
// How a device lies in a scene, remembered for each pair of them.
#include <filesystem>
#include <map>
#include <string>

#include "haptics/device/workspace.hpp"

namespace touchstone::sandbox {

/// In `FOLDER/workspaces.json`, an entry for each scene and device; an empty folder keeps them in memory only.
class WorkspaceFile {
  public:
    explicit WorkspaceFile(std::filesystem::path folder = {});
    /// The default where nothing was saved. Throws std::runtime_error with one sentence naming file and field.
    Workspace load(const std::filesystem::path& scene, const std::string& device) const;
    /// Throws std::runtime_error when the file cannot be read or written; it is kept for this run all the same.
    void save(const std::filesystem::path& scene, const std::string& device, const Workspace& workspace);

  private:
    std::filesystem::path file_;
    std::map<std::string, Workspace> changed_;  // in this run
};

}  // namespace touchstone::sandbox
