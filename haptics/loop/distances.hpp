#pragma once
// Gaps and overlaps of tool and obstacles, found independently of the tick, so that reports and tests can judge it.
#include <span>
#include <vector>

#include "haptics/collision/tree_walk.hpp"
#include "haptics/loop/world.hpp"

namespace touchstone {

/// Depth up to which tool and obstacle count as touching at a start, mm: the distance that is kept, and the rounding of
/// points and poses to the floats of a file, but no more than that distance again.
double startDepth(const World& world, std::size_t obstacle, const Pose& X_WO, const Pose& X_WT, double kept);

/// Whether ticks that begin at X_WT would have kOverlapping. Meshes that overlap by up to the distance that is kept and
/// the rounding of a file only touch: the first tick leads the tool out. X_WO: as for trueClearance().
bool startsInside(const World& world, const Pose& X_WT, std::span<const Pose> X_WO, const Settings& settings);

/// The true smallest gap of tool and obstacles at X_WT, mm, negative if they overlap, but at most `atMost`. It is found
/// by branch and bound over the trees and independently of the tick, so that reports and tests can judge the tick by
/// it. For meshes that overlap: overlapDepth(). X_WO: poses of the obstacles, if they differ from the
/// world's.
double trueClearance(const World& world, const Pose& X_WT, double atMost = 1e30, std::span<const Pose> X_WO = {},
                     Geometry geometry = Geometry::Spheres);

/// Measures only the deepest overlap, for callers that need it at every tick. For spheres: max(0, -trueClearance),
/// equal to the last bit, in a fraction of the time where surfaces conform. For meshes: 0 unless they overlap, and then
/// overlapDepth(); all triangles are tested. It does not use the tick's lists. Only the constructor allocates.
class PenetrationMeter {
  public:
    explicit PenetrationMeter(const World& world);
    double depth(const Pose& X_WT, std::span<const Pose> X_WO = {}, Geometry geometry = Geometry::Spheres);  ///< mm

  private:
    const World* world_;
    std::vector<TreeWalk> walks_;
    double depth_ = 0;  ///< at the last pose, mm
};

}  // namespace touchstone
