#pragma once
// The results of a study's trials in its folder, and their summary.
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "haptics/sandbox/trials/protocol.hpp"

namespace touchstone::app {

inline constexpr const char *kProtocolFile = "protocol.json", *kRowFile = "row.json";

/// A row of the table of trials: a flat object; all rows have the same keys.
using TrialRow = nlohmann::ordered_json;

/// The folder of a trial within the folder of the study.
std::filesystem::path trialFolder(const std::filesystem::path& study, int trial);

/// The scene_hash of each scene that a condition names.
using SceneHashes = std::map<std::string, nlohmann::ordered_json>;

/// The rows of all trials of the protocol that are complete in one of the folders, by number. Throws std::runtime_error
/// with one sentence when a row cannot be read or does not belong to its trial, when a trial is in two of the folders,
/// or when trials were run in different versions of a scene; `scenes` may give the versions that are expected.
std::vector<TrialRow> readRows(const std::vector<std::filesystem::path>& studies, const sandbox::Protocol& protocol,
                               SceneHashes scenes = {});

/// Writes trials.csv.
void writeTable(const std::filesystem::path& folder, const std::vector<TrialRow>& rows);
/// Prints the summary, writes it as summary.csv, and draws its figures. Pre: at least one row.
void summarize(const std::filesystem::path& folder, const std::vector<TrialRow>& rows,
               const sandbox::Protocol& protocol);

/// Runs what is missing of the study of a protocol file without a window and writes its results to `out`, as
/// `touchstone trials --headless` does. Returns an exit code.
int runStudy(const std::filesystem::path& protocol, const std::filesystem::path& out);

}  // namespace touchstone::app
