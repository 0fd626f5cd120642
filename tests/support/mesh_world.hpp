#pragma once
// Worlds of parts that touch by their meshes.
#include "haptics/loop/settings.hpp"
#include "haptics/surface/surface_overlap.hpp"
#include "tests/support/sphere_models.hpp"
#include "tests/support/test_meshes.hpp"

namespace touchstone::test {

inline TriangleMesh centeredBox(double x, double y, double z) { return boxMesh({x, y, z}, {-x / 2, -y / 2, -z / 2}); }

inline Surface surfaceOf(const TriangleMesh& mesh) { return Surface(surfaceFeatures(repairMesh(mesh))); }

/// The world, whose tool and only obstacle get meshes besides their leaves.
inline World withMeshes(World world, const TriangleMesh& tool, const TriangleMesh& obstacle) {
    world.tool.surface = std::make_shared<const Surface>(surfaceOf(tool));
    world.obstacles[0].part.surface = std::make_shared<const Surface>(surfaceOf(obstacle));
    return world;
}

/// A world of meshes. The sphere trees are single leaves, which no tick between meshes may look at.
inline World meshWorld(const TriangleMesh& tool, const TriangleMesh& obstacle, const Pose& start) {
    return withMeshes(worldOf(ball(1), ball(1), start), tool, obstacle);
}

/// Whether meshes overlap, with the obstacles at X_WO.
inline bool meshesOverlap(const World& world, const Pose& X_WT, std::span<const Pose> X_WO) {
    for (std::size_t k = 0; k < X_WO.size(); ++k)
        if (overlap(*world.tool.surface, *world.obstacles[k].part.surface, X_WO[k].inverse() * X_WT)) return true;
    return false;
}

/// The settings for a geometry.
inline Settings settingsFor(Geometry geometry) {
    Settings settings;
    settings.geometry = geometry;
    settings.shadow = kNoSolver;
    return settings;
}

}  // namespace touchstone::test
