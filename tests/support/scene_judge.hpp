#pragma once
// The judge of a scene's meshes, as they are in its file.
#include <span>
#include <vector>

#include "haptics/sandbox/scene/baked_mesh.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "tests/support/exact_judge.hpp"

namespace touchstone::test {

class SceneJudge {
  public:
    explicit SceneJudge(const sandbox::HapticScene& scene) {
        const TriangleMesh tool = sandbox::bakedTriangles(scene.scene, scene.roles.tool);
        for (const auto obstacle : scene.roles.obstacles)
            obstacles_.emplace_back(tool, sandbox::bakedTriangles(scene.scene, obstacle));
        for (const Obstacle& obstacle : scene.world->obstacles) X_WO_.push_back(obstacle.X_WO);
    }

    /// Whether the tool overlaps any obstacle. X_WO: their poses, if they differ from the world's.
    bool overlap(const Pose& X_WT, std::span<const Pose> X_WO = {}) const {
        for (std::size_t k = 0; k < obstacles_.size(); ++k)
            if (obstacles_[k].overlap((X_WO.empty() ? X_WO_[k] : X_WO[k]).inverse() * X_WT)) return true;
        return false;
    }

  private:
    std::vector<ExactJudge> obstacles_;
    std::vector<Pose> X_WO_;
};

}  // namespace touchstone::test
