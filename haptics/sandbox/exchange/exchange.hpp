#pragma once
// Export of recordings as files that other programs read, and the check of such files. See docs/recording.md.
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "haptics/sandbox/exchange/demonstration.hpp"

namespace touchstone::sandbox {

struct ExportRequest {
    std::vector<std::filesystem::path> recordings;  ///< become demo_0, demo_1, …
    std::filesystem::path scene = {};               ///< where their scenes are, see SceneShelf
    std::filesystem::path hdf5 = {}, mcap = {};     ///< files to write; empty: none
    bool carryScenes = true;                        ///< false: scenes are only named, by the hash of their content
    SceneProgress progress = {};
    std::function<void(const std::string&)> report = {};  ///< receives one line for each demonstration
};

/// Replays every recording and writes those files; each is complete afterwards, and absent on an error. Throws
/// std::exception with one sentence, also if a recording does not agree with its replay.
void exportDemonstrations(const ExportRequest& request);

/// Replays what is in a recording's folder or in an exported file, and compares it tick by tick. `report` receives one
/// line for each demonstration. Throws std::exception with one sentence that says what is missing, damaged or
/// different. `scene`: where scenes are that it does not hold, see SceneShelf.
void verifyDemonstrations(const std::filesystem::path& recordingOrFile, const SceneProgress& progress,
                          const std::function<void(const std::string&)>& report,
                          const std::filesystem::path& scene = {});

}  // namespace touchstone::sandbox
