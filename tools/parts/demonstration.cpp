#include "tools/parts/demonstration.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace touchstone::app {

void Demonstration::follow(double seconds, const std::function<ToolPose(double)>& path, double step) {
    const double start = keys_.back().seconds;
    const int samples = static_cast<int>(std::ceil(seconds / step - 1e-9));
    for (int i = 1; i <= samples; ++i) {
        const double t = seconds * i / samples;
        keys_.push_back({start + t, path(t)});
    }
}

engine::Animation Demonstration::animation(engine::Entity tool, std::string name, nlohmann::json outcome) const {
    engine::AnimationChannel translation, rotation;
    translation.target = rotation.target = tool;
    translation.path = engine::AnimationPath::Translation;
    rotation.path = engine::AnimationPath::Rotation;
    for (const Key& key : keys_) {
        translation.times.push_back(key.seconds);
        translation.values.emplace_back(key.pose.position / 1000.0, 0);
        const glm::dquat& q = key.pose.rotation;
        rotation.times.push_back(key.seconds);
        rotation.values.emplace_back(q.x, q.y, q.z, q.w);
    }
    engine::Animation animation{std::move(name), {std::move(translation), std::move(rotation)}};
    if (!outcome.is_null()) *animation.extras = {{"touchstone", {{"outcome", std::move(outcome)}}}};
    return animation;
}

}  // namespace touchstone::app
