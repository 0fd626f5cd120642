#pragma once
// Motions of the tool as keyframes.
#include <functional>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/scene/animation.hpp"

namespace touchstone::app {

/// Pose of the tool node in its parent's frame; position in mm.
struct ToolPose {
    glm::dvec3 position{0};
    glm::dquat rotation{1, 0, 0, 0};
};

/// Strings pieces of motion together, each from where the last one ended.
class Demonstration {
  public:
    explicit Demonstration(const ToolPose& start) : keys_{{0, start}} {}

    void hold(double seconds) { moveTo(keys_.back().pose, seconds); }
    /// At constant speed on a straight line, turning about one axis.
    void moveTo(const ToolPose& pose, double seconds) { keys_.push_back({keys_.back().seconds + seconds, pose}); }
    /// Along path(t), t from 0 to `seconds`, sampled every `step` seconds; path(0) is to be where the motion stands.
    void follow(double seconds, const std::function<ToolPose(double)>& path, double step = 0.005);

    /// In no more time than the rotation and translation channels can tell apart: from one tick to the next.
    void jumpTo(const ToolPose& pose) { moveTo(pose, 5e-5); }

    /// Linear channels for translation (metres) and rotation of `tool`; with an outcome if it is to have its own.
    engine::Animation animation(engine::Entity tool, std::string name = "demonstration",
                                nlohmann::json outcome = nullptr) const;

  private:
    struct Key {
        double seconds;
        ToolPose pose;
    };
    std::vector<Key> keys_;
};

}  // namespace touchstone::app
