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

/// Joins pieces of motion, each starting where the previous one ended.
class Demonstration {
  public:
    explicit Demonstration(const ToolPose& start) : keys_{{0, start}} {}

    void hold(double seconds) { moveTo(keys_.back().pose, seconds); }
    /// Moves at constant speed on a straight line, turning about one axis.
    void moveTo(const ToolPose& pose, double seconds) { keys_.push_back({keys_.back().seconds + seconds, pose}); }
    /// Moves along path(t), t from 0 to `seconds`, sampled every `step` seconds; path(0) must be the current pose.
    void follow(double seconds, const std::function<ToolPose(double)>& path, double step = 0.005);

    /// Jumps to a pose in the shortest time that the channels can resolve: from one tick to the next.
    void jumpTo(const ToolPose& pose) { moveTo(pose, 5e-5); }

    /// Linear channels for translation (meters) and rotation of `tool`; with an outcome if the motion has its own.
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
