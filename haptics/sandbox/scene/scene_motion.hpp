#pragma once
// The motions of a scene: its glTF animations of the tool node. The first one is the demonstration.
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/animation.hpp"
#include "engine/scene/scene.hpp"
#include "haptics/hands/motion.hpp"

namespace touchstone::sandbox {

/// Pose of an animated node in the scene frame, with its ancestors at rest. Uses translation and rotation channels
/// only.
class SceneMotion final : public Motion {
  public:
    /// Pre: the animation moves `node`.
    SceneMotion(const engine::Scene& scene, const engine::Animation& animation, engine::Entity node);
    Pose at(double t) const noexcept override;
    double duration() const noexcept override { return duration_; }

  private:
    engine::Animation channels_;  // of the node only
    engine::Entity node_;
    engine::LocalTransform rest_;
    glm::dmat4 parent_{1};
    double duration_ = 0;
};

/// The keys as an animation of `node` with linear channels without target, for engine::SetMotion. They are rounded to
/// single precision, so that a saved file has the same motion. Pre: the keys are those of a RecordedMotion.
engine::Animation animationOf(const engine::Scene& scene, engine::Entity node, std::span<const MotionKey> keys);

/// True if the animation moves the tool, which makes it one of the scene's motions.
bool movesTool(const engine::Animation& animation, engine::Entity tool);

/// The animations with a translation or rotation channel on the tool, in file order; the first is the demonstration.
/// `warnings` name what is ignored: scale of the tool, and animated ancestors, parts and obstacles.
std::vector<NamedMotion> findMotions(const engine::Scene& scene, engine::Entity tool,
                                     const std::vector<engine::Entity>& obstacles, std::vector<std::string>& warnings);

}  // namespace touchstone::sandbox
