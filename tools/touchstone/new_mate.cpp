#include "tools/touchstone/new_mate.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>

#include "engine/scene/text.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::app {

std::optional<sandbox::MateProposal> mateOf(const StepParts& parts, const engine::RigidPart& pose,
                                            const sandbox::MateConstraints& given) {
    const auto bodyParts = [&](const StepParts::Body& body, const glm::dmat4& place) {
        std::vector<sandbox::MatePart> found;
        for (const std::uint32_t index : body.parts) {
            const engine::CadAssembly& assembly = parts.assemblyOf(body);
            const engine::CadPart& part = assembly.parts[index];
            found.push_back({part.name, &assembly.shapes[part.shape], place * part.placement});
        }
        return found;
    };
    const std::vector<sandbox::MatePart> tool = bodyParts(parts.tool(), engine::rigidMatrix(pose));
    std::vector<sandbox::MatePart> obstacles;
    for (const StepParts::Body& body : parts.obstacles()) {
        const std::vector<sandbox::MatePart> more = bodyParts(body, glm::dmat4(1));
        obstacles.insert(obstacles.end(), more.begin(), more.end());
    }
    return sandbox::proposeMate(tool, obstacles, given);
}

std::string toolPoseText(const engine::RigidPart& pose) {
    const glm::dmat3 r(glm::mat3_cast(pose.rotation));  // columns; Rz Ry Rx
    const double y = std::asin(std::clamp(-r[0].z, -1.0, 1.0));
    // With y a quarter of a turn, x and z turn about one axis: z stays 0.
    const bool locked = std::abs(r[0].z) > 1 - 1e-12;
    const double x = locked ? std::atan2(-r[2].y, r[1].y) : std::atan2(r[1].z, r[2].z);
    const double z = locked ? 0 : std::atan2(r[0].y, r[0].x);
    // To a nanometer and a millionth of a degree.
    const auto rounded = [](double value) { return engine::formatted("%.9g", std::round(value * 1e6) / 1e6 + 0.0); };
    std::string text;
    for (int k = 0; k < 3; ++k) text += rounded(pose.translation[k] * sandbox::kMmPerMeter) + "mm,";
    return text + rounded(glm::degrees(x)) + "," + rounded(glm::degrees(y)) + "," + rounded(glm::degrees(z));
}

}  // namespace touchstone::app
