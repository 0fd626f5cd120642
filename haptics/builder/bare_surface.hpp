#pragma once
// Finds the part of a surface that no leaf covers. The tree check uses it: it shares no code with the builder's proof.
#include <functional>
#include <span>

#include "haptics/builder/leaf_union.hpp"
#include "haptics/builder/triangle_bvh.hpp"

namespace touchstone {

struct BareSurface {
    bool covered = true;        ///< proven: every triangle can be cut into pieces with all corners in one leaf
    double area = 0;            ///< of the bare part
    double largestGap = 0;      ///< largest distance of a bare point from the nearest leaf
    Vec3 where = Vec3::Zero();  ///< the point with the largest gap
};

/// Finds what is bare: what no leaf covers. A leaf is convex, so a piece of a triangle with all corners in one leaf is
/// covered. Any other piece is halved at its longest side: down to the length `fine` if a corner is bare, otherwise
/// down to 2^-40, where the rest counts as bare. With `firstOnly`, the search ends at the first bare piece and sets
/// only `covered`, `area` of that piece and `where`. Lengths should be of the order of one. Memory: one list of leaves
/// for each level of halving. `beat` receives the progress, 0 to 1.
BareSurface findBareSurface(std::span<const Triangle> surface, const LeafUnion& leaves, double fine, bool firstOnly,
                            const std::function<void(double)>& beat);

}  // namespace touchstone
