#pragma once
// What the trials of a study left in its folder, and what they amount to.
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "haptics/sandbox/trials/protocol.hpp"

namespace touchstone::app {

inline constexpr const char *kProtocolFile = "protocol.json", *kRowFile = "row.json";

/// A row of the table of trials: one flat object, the same keys in each.
using TrialRow = nlohmann::ordered_json;

/// The folder of a trial within that of the study.
std::filesystem::path trialFolder(const std::filesystem::path& study, int trial);

/// scene_hash of the scenes that conditions name.
using SceneHashes = std::map<std::string, nlohmann::ordered_json>;

/// The rows of all trials of the protocol that are whole in one of the folders, by number. Throws std::runtime_error
/// with one sentence when a row cannot be read or is no row of its trial, a trial is in two of the folders, or trials
/// were not all done in the same scenes: those of `scenes`, if it names them.
std::vector<TrialRow> readRows(const std::vector<std::filesystem::path>& studies, const sandbox::Protocol& protocol,
                               SceneHashes scenes = {});

/// Writes trials.csv.
void writeTable(const std::filesystem::path& folder, const std::vector<TrialRow>& rows);
/// Writes summary.csv and plots, and prints it. Pre: at least one row.
void summarise(const std::filesystem::path& folder, const std::vector<TrialRow>& rows,
               const sandbox::Protocol& protocol);

}  // namespace touchstone::app
