#pragma once
// Worlds that touch by their meshes.
#include "tests/support/sphere_models.hpp"
#include "tests/support/test_meshes.hpp"

namespace touchstone::test {

inline Surface surfaceOf(const TriangleMesh& mesh) {
    return Surface(surfaceFeatures(repairMesh(mesh)));
}

/// A world of meshes. The sphere trees are single leaves, which no tick between meshes may look at.
inline World meshWorld(const TriangleMesh& tool, const TriangleMesh& obstacle, const Pose& start) {
    World world = worldOf(ball(1), ball(1), start);
    world.toolSurface = std::make_shared<const Surface>(surfaceOf(tool));
    world.obstacles[0].surface = std::make_shared<const Surface>(surfaceOf(obstacle));
    return world;
}

}  // namespace touchstone::test
