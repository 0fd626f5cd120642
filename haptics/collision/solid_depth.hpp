#pragma once
// How deep a point lies in a body that may be walls, sheets, or both.
#include "haptics/collision/mesh_repair.hpp"

namespace touchstone {

/// Signed depth in the body: the points that the closed shells wind around, and the sheets. Positive inside, where it
/// is the distance to the walls; outside it is minus the distance to the body. It is 1-Lipschitz, so a sphere of radius
/// r about c reaches no further than r - depth(c) out of the body. Lengths in the frame of RepairedMesh.
class SolidDepth {
  public:
    explicit SolidDepth(const RepairedMesh& mesh);

    /// The nearest point of the walls alone, if it is nearer than `bound`.
    TriangleBvh::Hit wall(const Vec3& p, double bound = HUGE_VAL) const { return walls_.closest(p, bound); }
    bool hasWalls() const { return !walls_.empty(); }
    bool inside(const Vec3& p) const;
    double depth(const Vec3& p) const;

  private:
    TriangleBvh walls_, sheets_;
    TriangleBvh shells_;  ///< closed shells with what is buried in them; empty if that is nothing
};

}  // namespace touchstone
