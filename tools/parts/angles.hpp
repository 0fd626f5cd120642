#pragma once
// Full turns, axes and rotations about an axis.
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>

namespace touchstone::app {

inline constexpr double kPi = std::numbers::pi, kTau = 2 * kPi;

/// Rotation by an angle in rad about a unit axis.
inline glm::dquat about(const glm::dvec3& axis, double angle) { return glm::angleAxis(angle, axis); }

/// The axes as unit vectors.
inline constexpr glm::dvec3 kX(1, 0, 0), kY(0, 1, 0), kZ(0, 0, 1);

}  // namespace touchstone::app
