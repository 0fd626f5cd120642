#pragma once
// The protocol file of a study: participants, conditions, repetitions and order. docs/trials.md lists its keys.
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "haptics/loop/settings.hpp"
#include "haptics/sandbox/trials/phases.hpp"

namespace touchstone::sandbox {

/// A condition of the study: a scene, which determines the clearance, a device and rendering settings.
struct Condition {
    std::string name, scene, device;
    double timeLimit = 30;  ///< s
    std::vector<std::pair<std::string, std::string>>
        set;  ///< keys of settingTable() with values, in the order of setting

    /// Applies the condition to the scene's settings, without a shadow solver. Throws std::runtime_error with one
    /// sentence when the settings are inconsistent.
    Settings settings(Settings changed) const;
};

struct Participant {
    std::string name;
    std::uint64_t seed = 0;
};

/// One trial of a study.
struct Trial {
    int number = 0;  ///< from 1, over the whole study
    int participant = 0, condition = 0;
    int repetition = 0;      ///< from 1
    int order = 0;           ///< from 1, within the participant's trials
    std::uint64_t seed = 0;  ///< random seed of the trial, the same for all conditions of a repetition
};

struct Protocol {
    std::uint64_t seed = 1;
    bool randomOrder = true;
    int repetitions = 1;
    std::vector<Participant> participants;
    std::vector<Condition> conditions;
    PhaseLimits limits;
    nlohmann::ordered_json source;  ///< the JSON as read

    /// All trials, participant by participant. The trials of each participant are shuffled by the random seed, or
    /// listed repetition by repetition. The result depends on the protocol only, not on the machine.
    std::vector<Trial> trials() const;
};

/// Reads a protocol. Throws std::runtime_error with one sentence that names file and field and says what to do.
Protocol readProtocol(const std::filesystem::path& file);
Protocol readProtocol(const nlohmann::ordered_json& source, const std::string& file);

/// A study to begin with: five simulated hands put the tool of a scene file into its goal.
nlohmann::ordered_json firstStudy(const std::string& scene, const std::string& condition);
inline constexpr const char* kStudyFile = "study.json";

}  // namespace touchstone::sandbox
