#pragma once
// The parts of recording.json as values; shared by those who write and read it.
#include <nlohmann/json.hpp>

#include "haptics/sandbox/record/recording.hpp"

namespace touchstone::sandbox {

inline constexpr const char *kTicksFile = "ticks.npy", *kNotesFile = "recording.json";
inline constexpr const char* kFormat = "touchstone recording";
inline constexpr int kFormatVersion = 1;
/// Ends recording.json behind the last change.
inline constexpr const char *kChangesBegin = "\"changes\": [", *kNotesEnd = "\n ]\n}\n";

nlohmann::ordered_json toJson(const RecordedScene& scene);
/// X_WO: where the obstacles were then; empty: not told.
nlohmann::ordered_json toJson(const StepStart& start, std::span<const Pose> X_WO);
/// All settings, or those that differ from `before`; stiffness, torsion and pause stand in every row.
nlohmann::ordered_json toJson(const Settings& settings, const Settings* before);

/// These throw std::invalid_argument that names the field.
RecordedScene toRecordedScene(const nlohmann::json& json);
StepStart toStart(const nlohmann::json& json);
/// Where the obstacles were at a start; empty where it does not tell.
std::vector<Pose> toObstacles(const nlohmann::json& start);
void applySettings(Settings& settings, const nlohmann::json& json);
const nlohmann::json& fieldOf(const nlohmann::json& object, const char* key);
std::string textOf(const nlohmann::json& object, const char* key);
std::uint64_t countOf(const nlohmann::json& object, const char* key);

}  // namespace touchstone::sandbox
