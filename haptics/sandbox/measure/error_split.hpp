#pragma once
// How far a tick is from the truth, and what each simplification has to do with it.
#include "haptics/reference/mesh_reference.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// A difference of two answers: lengths of the differences of C, rotation, force and torque about C.
struct AnswerError {
    double position = 0;  ///< mm
    double rotation = 0;  ///< rad
    double force = 0;     ///< N
    double torque = 0;    ///< mN·m
};

/// Truth and answer, and the steps from one to the other. The shares are vectors that add up, so their lengths need
/// not.
struct ErrorSplit {
    AnswerError total;          ///< of the tick against the meshes
    AnswerError geometry;       ///< of sphere trees, solved to convergence, against the meshes
    AnswerError linearisation;  ///< of one tick with the exact solver against that convergence
    AnswerError solver;         ///< of the tick against one with the exact solver
    MeshReferenceAnswer truth;
    Pose X_WT_converged;     ///< tool node where sphere trees and exact solver come to rest
    bool converged = false;  ///< both did; if not, the shares are not to be trusted
};

/// The reference for a scene: its own meshes. Throws engine::SceneError or std::invalid_argument with one sentence.
MeshReference meshReferenceOf(const HapticScene& scene, const MeshReferenceOptions& options = {});

/// Splits the error of the tick `now`, which came after `before` in a run with these settings. Offline: milliseconds to
/// seconds. Throws std::invalid_argument with one sentence when the meshes meet, as where bodies overlap.
ErrorSplit splitError(const World& world, const Settings& settings, const MeshReference& reference,
                      const TickRecord& before, const TickRecord& now);

}  // namespace touchstone::sandbox
