#pragma once
// What a scene of STEP files needs and nobody gave: where the tool goes, found from the surfaces of the parts.
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/transforms.hpp"
#include "haptics/sandbox/scene/mates.hpp"
#include "tools/touchstone/step_parts.hpp"

namespace touchstone::app {

/// The mate of the tool, which lies at `pose` in the frame of its file, with those obstacles that are of STEP files.
/// Nothing if there is none.
std::optional<sandbox::MateProposal> mateOf(const StepParts& parts, const engine::RigidPart& pose,
                                            const sandbox::MateWish& wish);

/// The value of --tool-pose that gives this pose.
std::string toolPoseText(const engine::RigidPart& pose);

}  // namespace touchstone::app
