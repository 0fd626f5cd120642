#pragma once
// A study as a file: who does what, how often, in which order. docs/trials.md has the keys.
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

/// What is varied: a scene, which brings its clearance, and what renders it.
struct Condition {
    std::string name, scene, device;
    double timeLimit = 30;                                 ///< s
    std::vector<std::pair<std::string, std::string>> set;  ///< keys of settingTable() with their values, in order

    /// The scene's settings changed to these, without a shadow. Throws std::runtime_error with one sentence when they
    /// do not go together.
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
    int order = 0;           ///< from 1, of the participant's trials
    std::uint64_t seed = 0;  ///< of what differs from trial to trial: the same under every condition
};

struct Protocol {
    std::uint64_t seed = 1;
    bool randomOrder = true;
    int repetitions = 1;
    std::vector<Participant> participants;
    std::vector<Condition> conditions;
    PhaseLimits limits;
    nlohmann::ordered_json source;  ///< as it was read

    /// All trials, participant by participant, each in its order: shuffled by the seed, or as listed, repetition by
    /// repetition. The same for the same protocol, everywhere.
    std::vector<Trial> trials() const;
};

/// Throws std::runtime_error with one sentence that names the file and the field and says what to do.
Protocol readProtocol(const std::filesystem::path& file);
Protocol readProtocol(const nlohmann::ordered_json& source, const std::string& file);

}  // namespace touchstone::sandbox
