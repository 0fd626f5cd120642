#pragma once
// How far a tick is from the truth, split by the simplification that causes the error.
#include "haptics/reference/mesh_reference.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// The difference of two answers: lengths of the differences in position of C, rotation, force and torque about C.
struct AnswerError {
    double position = 0;  ///< mm
    double rotation = 0;  ///< rad
    double force = 0;     ///< N
    double torque = 0;    ///< mN·m
};

/// The error of a tick and its shares. As vectors the shares add up to the total; their lengths need not.
struct ErrorSplit {
    AnswerError total;  ///< the tick against the meshes
    /// The geometry of the tick, solved to convergence, against the meshes: the protrusion of sphere trees; between
    /// meshes the contact distance δ, less the distance that the reference keeps (MeshReferenceOptions::shell).
    AnswerError geometry;
    AnswerError linearization;  ///< one tick with the exact solver against that converged solution
    AnswerError solver;         ///< the tick against one with the exact solver
    MeshReferenceAnswer truth;
    Pose X_WT_converged;     ///< tool pose where this geometry and the exact solver come to rest
    bool converged = false;  ///< both solutions converged; if not, the shares cannot be trusted
};

/// The reference for a scene, from its own meshes. Throws engine::SceneError or std::invalid_argument with one
/// sentence.
MeshReference meshReferenceOf(const HapticScene& scene, const MeshReferenceOptions& options = {});

/// Splits the error of the tick `now`, which follows `before` in a run with these settings. Offline: it takes
/// milliseconds to seconds. Throws std::invalid_argument with one sentence if the meshes intersect.
ErrorSplit splitError(const World& world, const Settings& settings, const MeshReference& reference,
                      const TickRecord& before, const TickRecord& now);

}  // namespace touchstone::sandbox
