#pragma once
// Stores the workspace (placement of the device in the scene) for each pair of scene and device.
#include <filesystem>
#include <map>
#include <string>

#include "haptics/device/workspace.hpp"

namespace touchstone::sandbox {

/// In `FOLDER/workspaces.json`, one entry for each scene and device; with an empty folder in memory only.
class WorkspaceFile {
  public:
    explicit WorkspaceFile(std::filesystem::path folder = {});
    /// The default if nothing was saved. Throws std::runtime_error with one sentence that names file and field.
    Workspace load(const std::filesystem::path& scene, const std::string& device) const;
    /// Throws std::runtime_error if the file cannot be read or written; the workspace is still kept until the program
    /// ends.
    void save(const std::filesystem::path& scene, const std::string& device, const Workspace& workspace);

  private:
    std::filesystem::path file_;
    std::map<std::string, Workspace> changed_;  // saved since the program started
};

}  // namespace touchstone::sandbox
