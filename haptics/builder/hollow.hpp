#pragma once
// Fills the inside of a body whose surface is covered, so that no small tool fits into a hollow.
#include <span>

#include "haptics/builder/solid_depth.hpp"
#include "haptics/builder/workers.hpp"

namespace touchstone {

struct SolidSphere {
    Vec3 center;
    double radius;
};

struct Filling {
    std::vector<Vec3> centers;  ///< centers of the balls to add; the radius of each is its depth
    double hollow = 0;  ///< proven bound: no larger ball inside the body is clear of the leaves and of these balls
};

/// Adds a ball at the largest hollow until no hollow is larger than `enough` or `maxBalls` are placed. Pre: the leaves
/// cover the surface. Lengths in the frame of RepairedMesh. The hollow at x has the radius min(depth(x), distance to
/// the leaves). That function is 1-Lipschitz, so branch and bound over an octree finds its maximum and proves it.
Filling fillHollows(const SolidDepth& solid, std::span<const SolidSphere> leaves, double enough, std::size_t maxBalls,
                    const Workers& workers);

}  // namespace touchstone
