#pragma once
// Keyframe animation of nodes, sampled as glTF 2.0 specifies (appendix C, "Animation Sampler Interpolation Modes").
#include <glm/gtc/quaternion.hpp>
#include <string>
#include <vector>

#include "engine/scene/components.hpp"

namespace touchstone::engine {

enum class AnimationPath { Translation, Rotation, Scale };
enum class Interpolation { Step, Linear, CubicSpline };

/// One animated property of one node. `times`: seconds, finite, strictly increasing, at least one (two for cubic
/// splines). `values`: one per key, or in-tangent, value and out-tangent per key for cubic splines; translation
/// (meters) and scale in xyz, rotation as the quaternion xyzw.
struct AnimationChannel {
    Entity target;
    AnimationPath path = AnimationPath::Translation;
    Interpolation interpolation = Interpolation::Linear;
    std::vector<double> times;
    std::vector<glm::dvec4> values;
};

struct Animation {
    std::string name;
    std::vector<AnimationChannel> channels;
    JsonValue extras{};  ///< of the glTF animation object; null if it has none
};

/// Value of a translation or scale channel at `seconds`; clamped to the end values outside the keys.
glm::dvec3 sampleVector(const AnimationChannel& channel, double seconds);

/// Value of a rotation channel at `seconds`, of unit length: spherical interpolation on the shorter path, or the
/// normalized cubic spline; clamped to the end values outside the keys.
glm::dquat sampleRotation(const AnimationChannel& channel, double seconds);

/// Local transform of `node` at `seconds`: `rest` with the animated properties replaced.
LocalTransform sampleNode(const Animation& animation, Entity node, const LocalTransform& rest, double seconds);

/// True when a channel moves `node`.
bool animates(const Animation& animation, Entity node);

/// Time of the last key, seconds; 0 without channels.
double endTime(const Animation& animation);

/// Sets the local transforms of all animated nodes. Call updateWorldTransforms() afterwards.
void applyAnimation(Registry& registry, const Animation& animation, double seconds);

}  // namespace touchstone::engine
