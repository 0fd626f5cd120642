#pragma once
// Triangulates an area of the plane within slabs of equal width: on a cylinder or cone, a slab is a facet.
#include <array>
#include <vector>

namespace touchstone::step {

struct SlabNode {
    double s = 0;  ///< across the slabs: slab k lies between k and k + 1
    double v = 0;  ///< along them
};

/// An area bounded by directed chords, with the area to their left. No chord crosses a line between slabs; it may end
/// on one, or lie in it.
struct SlabArea {
    std::vector<SlabNode> nodes;
    std::vector<std::array<int, 2>> chords;
    bool rows = false;  ///< slabs are cut at whole numbers of v, which no chord crosses either

    /// Adds a node wherever a line and a row meet within the area. Pre: rows.
    void addCrossings();
    /// Adds triangles whose corners are nodes, counter-clockwise: each lies in one slab and one row, and uses all nodes
    /// on its sides, so that neighbors share whole edges. Returns false if the chords enclose no area.
    bool triangulate(std::vector<std::array<int, 3>>& triangles) const;
};

}  // namespace touchstone::step
