#pragma once
// How far the surface of a part is from other parts, for display.
#include <array>
#include <span>
#include <vector>

#include "haptics/surface/surface.hpp"

namespace touchstone::sandbox {

/// A part's surface as patches with the gap at each corner. Lengths in mm, in the part's frame.
struct GapMap {
    std::vector<Vec3> points;
    std::vector<float> gaps;                  ///< by point; at most the limit
    std::vector<std::array<int, 3>> patches;  ///< points, counter-clockwise seen from outside
};

struct PlacedSurface {
    const Surface* surface;
    Pose X_PO;  ///< its frame in that of the part whose gaps are wanted
};

/// Gaps between the part and the nearest of the others, up to `limit`. Faces of the part within the limit are divided
/// until no side is longer than half the limit, or there are too many patches. The gap at a point is the exact distance
/// from the surfaces. Allocates; takes tens of milliseconds where large areas are near.
GapMap gapMap(const Surface& part, std::span<const PlacedSurface> others, double limit);

}  // namespace touchstone::sandbox
