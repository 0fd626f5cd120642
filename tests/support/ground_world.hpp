#pragma once
// A world with a known contact.
#include "haptics/collision/sphere_tree.hpp"
#include "haptics/loop/world.hpp"

namespace touchstone::test {

/// A tool of two balls of radius 5, `height` mm above the ground, which is the top of a ball of radius 1000: contact at
/// 5 mm.
inline std::shared_ptr<const World> groundBelow(const Vec3& up = Vec3::UnitY(), double height = 8) {
    World world;
    world.tool.spheres = std::make_shared<SphereTree>(makeSphereTree({{-3, 0, 0, 5}, {3, 0, 0, 5}}));
    world.obstacles.push_back({"ground",
                               {.spheres = std::make_shared<SphereTree>(makeSphereTree({{0, 0, 0, 1000}}))},
                               {-1000 * up, Quat::Identity()}});
    world.X_WT_start.p = height * up;
    return std::make_shared<World>(world);
}

}  // namespace touchstone::test
