#include "haptics/loop/distances.hpp"

#include <algorithm>

#include "haptics/collision/clearance.hpp"
#include "haptics/surface/surface_distance.hpp"
#include "haptics/surface/surface_overlap.hpp"

namespace touchstone {
namespace {

Pose obstaclePose(const World& world, std::span<const Pose> X_WO, std::size_t obstacle) {
    return obstacle < X_WO.size() ? X_WO[obstacle] : world.obstacles[obstacle].X_WO;
}

}  // namespace

double startDepth(const World& world, std::size_t obstacle, const Pose& X_WO, const Pose& X_WT, double kept) {
    const auto sizeOf = [](const Surface& part) { return part.extent.center.norm() + part.extent.reach; };
    const double largest =
        sizeOf(*world.tool.surface) + sizeOf(*world.obstacles[obstacle].part.surface) + X_WT.p.norm() + X_WO.p.norm();
    return kept + std::min(kept, 0x4p-24 * largest);
}

bool startsInside(const World& world, const Pose& X_WT, std::span<const Pose> X_WO, const Settings& settings) {
    for (std::size_t k = 0; k < world.obstacles.size(); ++k) {
        if (!world.byMeshes(k, geometryOf(settings))) continue;
        const Pose X = obstaclePose(world, X_WO, k);
        if (overlapsDeeper(*world.tool.surface, *world.obstacles[k].part.surface, X.inverse() * X_WT,
                           startDepth(world, k, X, X_WT, settings.contactDistance)))
            return true;
    }
    return false;
}

double trueClearance(const World& world, const Pose& X_WT, double atMost, std::span<const Pose> X_WO,
                     Geometry geometry) {
    double least = atMost;
    for (std::size_t k = 0; k < world.obstacles.size(); ++k) {
        const Pose X_OT = obstaclePose(world, X_WO, k).inverse() * X_WT;
        const Obstacle& obstacle = world.obstacles[k];
        if (!world.byMeshes(k, geometry)) {
            least = leastGap(*world.tool.spheres, *obstacle.part.spheres, X_OT, least);
            continue;
        }
        const Surface &ours = *world.tool.surface, &other = *obstacle.part.surface;
        if (overlap(ours, other, X_OT))
            least = std::min(least, -overlapDepth(ours, other, X_OT));
        else if (const auto nearest = nearestPoints(ours, other, X_OT, least))
            least = std::min(least, nearest->distance());
    }
    return least;
}

PenetrationMeter::PenetrationMeter(const World& world) : world_(&world) {
    if (!world.hasSpheres()) return;
    for (const Obstacle& obstacle : world.obstacles) walks_.emplace_back(*world.tool.spheres, *obstacle.part.spheres);
}

double PenetrationMeter::depth(const Pose& X_WT, std::span<const Pose> X_WO, Geometry geometry) {
    // Depth at the last pose, mm, from which the branch-and-bound search replaces the walk. The walk visits every
    // overlapping pair; a deep pose has many, most of which the search prunes. At shallow poses the walk is faster.
    constexpr double kDeep = 0.1;
    const bool deep = depth_ > kDeep;
    depth_ = 0;
    for (std::size_t k = 0; k < world_->obstacles.size(); ++k) {
        const Pose X_OT = obstaclePose(*world_, X_WO, k).inverse() * X_WT;
        if (world_->byMeshes(k, geometry)) {
            const Surface &ours = *world_->tool.surface, &other = *world_->obstacles[k].part.surface;
            if (overlap(ours, other, X_OT)) depth_ = std::max(depth_, overlapDepth(ours, other, X_OT));
            continue;
        }
        const SphereTree &tool = *world_->tool.spheres, &obstacle = *world_->obstacles[k].part.spheres;
        depth_ = std::max(depth_, -(deep || walks_.empty() ? leastGap(tool, obstacle, X_OT, 0)
                                                           : deepestGap(tool, obstacle, walks_[k], X_OT)));
    }
    return depth_;
}

}  // namespace touchstone
