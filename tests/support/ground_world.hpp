#pragma once
// A world whose contact is known by heart.
#include "haptics/loop/world.hpp"

namespace touchstone::test {

/// A tool of two balls R 5 above ground that is the top of a ball R 1000: contact where the tool node is at y = 5 mm.
inline std::shared_ptr<const World> groundBelow() {
    World world;
    world.tool = std::make_shared<SphereTree>(makeSphereTree({{-3, 0, 0, 5}, {3, 0, 0, 5}}));
    world.obstacles.push_back(
        {"ground", std::make_shared<SphereTree>(makeSphereTree({{0, 0, 0, 1000}})), {{0, -1000, 0}, Quat::Identity()}});
    world.X_WT_start.p.y() = 8;
    return std::make_shared<World>(world);
}

}  // namespace touchstone::test
