#pragma once
// The parts of recording.json as values; the writer and the reader share them.
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "haptics/loop/step.hpp"
#include "haptics/sandbox/record/recorded_scene.hpp"

namespace touchstone::sandbox {

inline constexpr const char *kTicksFile = "ticks.npy", *kNotesFile = "recording.json";
inline constexpr const char* kFormat = "touchstone recording";
inline constexpr int kFormatVersion = 1;
/// What surrounds the changes at the end of recording.json; a writer replaces kNotesEnd when it appends changes.
inline constexpr const char *kChangesBegin = "\"changes\": [", *kNotesEnd = "\n ]\n}\n";

nlohmann::ordered_json toJson(const RecordedScene& scene);
/// X_WO: obstacle poses at that moment; empty: not written.
nlohmann::ordered_json toJson(const TickStart& start, std::span<const Pose> X_WO);
/// All settings, or those that differ from `before`, except stiffness, torsion and pause, which every row holds.
nlohmann::ordered_json toJson(const Settings& settings, const Settings* before);

/// The following throw std::invalid_argument that names the field.
RecordedScene toRecordedScene(const nlohmann::json& json);
TickStart toStart(const nlohmann::json& json);
/// Obstacle poses at a start; empty if it does not hold them.
std::vector<Pose> toObstacles(const nlohmann::json& start);
/// Passes over settings that only earlier versions had.
void applySettings(Settings& settings, const nlohmann::json& json);
const nlohmann::json& fieldOf(const nlohmann::json& object, const char* key);
std::string textOf(const nlohmann::json& object, const char* key);
std::uint64_t countOf(const nlohmann::json& object, const char* key);

}  // namespace touchstone::sandbox
