#pragma once
// Finds from the surfaces of STEP parts where the tool goes, if the user did not say.
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/transforms.hpp"
#include "haptics/sandbox/scene/mates.hpp"
#include "tools/touchstone/step_parts.hpp"

namespace touchstone::app {

/// The mate of the tool, which lies at `pose` in the frame of its file, with the obstacles from STEP files. Nothing if
/// there is none.
std::optional<sandbox::MateProposal> mateOf(const StepParts& parts, const engine::RigidPart& pose,
                                            const sandbox::MateConstraints& given);

/// The value of --tool-pose that gives this pose.
std::string toolPoseText(const engine::RigidPart& pose);

}  // namespace touchstone::app
