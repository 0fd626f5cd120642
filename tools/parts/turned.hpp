#pragma once
// Solids of rings and sectors about the y axis, cut and added block by block.
#include <vector>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::app {

/// A radial plane, moved sideways: it stands at `angle` (rad, from +x towards -z) and `offset` mm further round. Two of
/// opposite offset are the parallel flanks of a key or a slot.
struct Flank {
    double angle, offset = 0;
};

/// What lies between two radii, two heights and two flanks, anticlockwise seen from +y; the whole round if `from` and
/// `to` are the same. Lengths in mm.
struct TurnedBlock {
    double inner, outer, low, high;
    Flank from{0}, to{0};
};

/// A solid made up of blocks, each added to or cut from what stands there before it. Where two blocks meet in nothing
/// but an edge, the mesh is not closed.
class TurnedSolid {
  public:
    void add(const TurnedBlock& block) { steps_.push_back({block, true}); }
    void cut(const TurnedBlock& block) { steps_.push_back({block, false}); }

    /// The surface, its curved faces inscribed to kChordError and its edges at most about `spacing` long.
    /// Throws std::invalid_argument with one sentence when flanks cross within the radii of the solid or stand further
    /// off the axis than their block begins. Pre: there is a block.
    engine::MeshData mesh(double spacing) const;

  private:
    struct Step {
        TurnedBlock block;
        bool added;
    };
    std::vector<Step> steps_;
};

}  // namespace touchstone::app
