#pragma once
// Solids of rings and sectors about the y axis, built by adding and cutting blocks.
#include <vector>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::app {

/// A radial plane at `angle` (rad, from +x toward -z), moved by `offset` mm in the direction of increasing angle. Two
/// planes with opposite offsets are the parallel flanks of a key or a slot.
struct Flank {
    double angle, offset = 0;
};

/// The region between two radii, two heights and two flanks, counter-clockwise seen from +y; the full circle if `from`
/// and `to` are equal. Lengths in mm.
struct TurnedBlock {
    double inner, outer, low, high;
    Flank from{0}, to{0};
};

/// A solid of blocks, each added to or cut from the blocks before it. If two blocks meet only in an edge, the mesh is
/// not closed.
class TurnedSolid {
  public:
    void add(const TurnedBlock& block) { steps_.push_back({block, true}); }
    void cut(const TurnedBlock& block) { steps_.push_back({block, false}); }

    /// The surface, its curved faces inscribed to kChordError and its edges at most about `spacing` long.
    /// Throws std::invalid_argument with one sentence when flanks cross within the radii of the solid or are farther
    /// from the axis than the inner radius of their block. Pre: there is at least one block.
    engine::MeshData mesh(double spacing) const;

  private:
    struct Step {
        TurnedBlock block;
        bool added;
    };
    std::vector<Step> steps_;
};

}  // namespace touchstone::app
