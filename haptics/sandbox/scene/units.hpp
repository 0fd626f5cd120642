#pragma once
// Conversion between the engine (glm, meters) and the haptics core (Eigen, mm). No other file converts.
#include "engine/scene/transforms.hpp"
#include "haptics/math/rigid.hpp"

namespace touchstone::sandbox {

inline constexpr double kMmPerMeter = 1000;

inline Vec3 toMm(const glm::dvec3& meters) { return kMmPerMeter * Vec3(meters.x, meters.y, meters.z); }
inline glm::dvec3 toMeters(const Vec3& mm) { return glm::dvec3(mm.x(), mm.y(), mm.z()) / kMmPerMeter; }
inline double toMeters(double mm) { return mm / kMmPerMeter; }

/// Directions have no unit.
inline glm::dvec3 toGlm(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
inline glm::dquat toGlm(const Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }
inline Quat toEigen(const glm::dquat& q) { return Quat(q.w, q.x, q.y, q.z).normalized(); }

/// The rigid part of a node's frame; scale, shear and mirroring are baked into the vertices.
inline Pose toPose(const engine::RigidPart& part) { return {toMm(part.translation), toEigen(part.rotation)}; }
inline Pose toPose(const glm::dmat4& matrix) { return toPose(engine::rigidPart(matrix)); }

/// The same back, in meters.
inline engine::RigidPart toRigidPart(const Pose& pose) { return {toMeters(pose.p), toGlm(pose.q)}; }
inline glm::dmat4 toMatrix(const Pose& pose) { return engine::rigidMatrix(toRigidPart(pose)); }

}  // namespace touchstone::sandbox
