#pragma once
// Filling a body whose surface is covered, so that nothing small can hide inside.
#include <span>

#include "haptics/builder/solid_depth.hpp"
#include "haptics/builder/workers.hpp"

namespace touchstone {

struct SolidSphere {
    Vec3 center;
    double radius;
};

struct Filling {
    std::vector<Vec3> centers;  ///< of balls to add, each as large as its depth
    double hollow = 0;          ///< no larger ball fits into the body clear of the leaves and of these; proven
};

/// Adds balls where the largest hollow is, until none of more than `enough` is left or `most` are placed. Pre: the
/// leaves cover the surface. Lengths in the frame of RepairedMesh. What can hide at x has the radius min(depth(x),
/// distance to the leaves), which is 1-Lipschitz: branch and bound over an octree finds and proves the largest.
Filling fillHollows(const SolidDepth& solid, std::span<const SolidSphere> leaves, double enough, std::size_t most,
                    const Workers& workers);

}  // namespace touchstone
