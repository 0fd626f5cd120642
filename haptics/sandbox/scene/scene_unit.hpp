#pragma once
// Scenes whose coordinates were written in another unit than meters.
#include <optional>
#include <string>
#include <vector>

#include "engine/edit/scene_edit.hpp"

namespace touchstone::sandbox {

/// mm: parts of other sizes suggest a wrong unit.
inline constexpr double kSmallestPart = 5, kLargestPart = 1000;

/// What to ask about parts of unlikely sizes.
struct UnitQuestion {
    double scale = 1;  ///< that brings all parts to likely sizes
    std::string text;  ///< one sentence, a question
};
/// `sizes`: of the parts named `labels`, mm. Nothing if all are likely, or if neither millimeters, centimeters nor
/// inches that were taken for meters, nor inches that were taken for millimeters, nor millimeters that were converted
/// twice, explain them.
std::optional<UnitQuestion> unitQuestion(const std::vector<std::string>& labels, const std::vector<double>& sizes);

/// The question, and the command that scales the scene if engine::scaled() can.
std::string scaleHint(const engine::Scene& scene, const UnitQuestion& question);

}  // namespace touchstone::sandbox
