#pragma once
// The part of a surface that no leaf covers. For checking: shares nothing with the builder's own proof.
#include <functional>
#include <span>

#include "haptics/builder/leaf_union.hpp"
#include "haptics/builder/triangle_bvh.hpp"

namespace touchstone {

struct BareSurface {
    bool none = true;           ///< proven: every triangle is cut into pieces with all corners in one leaf
    double area = 0;            ///< bare
    double largestGap = 0;      ///< from a bare point to the nearest leaf
    Vec3 where = Vec3::Zero();  ///< there
};

/// A leaf is convex, so a piece of a triangle with its corners in one leaf is covered; others are halved along their
/// longest side: down to `fine` where some corner is bare, and otherwise down to 2^-40 of the length 1, where what is
/// left counts as bare. With `first`, ends at the first bare piece, with no figures but the place. Lengths are to be of
/// the order of one. Memory: a list of leaves for each halving on the way down.
BareSurface findBareSurface(std::span<const Triangle> surface, const LeafUnion& leaves, double fine, bool first,
                            const std::function<void(double)>& beat);

}  // namespace touchstone
