#pragma once
// The depth of a point in a body that consists of walls, of sheets, or of both.
#include "haptics/builder/mesh_repair.hpp"

namespace touchstone {

/// Signed depth in the body. The body consists of the points that the closed shells wind around, and of the sheets.
/// Inside, the depth is positive and equals the distance to the walls; outside, it is minus the distance to the body.
/// The depth is 1-Lipschitz, so a sphere of radius r about c protrudes at most r - depth(c) out of the body. Lengths in
/// the frame of RepairedMesh.
class SolidDepth {
  public:
    explicit SolidDepth(const RepairedMesh& mesh);

    /// The nearest point of the walls alone; see TriangleBvh::closest().
    TriangleBvh::Hit wall(const Vec3& p, double bound, double enough, double tolerance) const {
        return walls_.closest(p, bound, enough, tolerance);
    }
    /// The radius of the largest ball that touches the walls at p from inside; see TriangleBvh::tangentRadius().
    double tangentRadius(const Vec3& p, const Vec3& inward, double radius, double slack) const {
        return walls_.tangentRadius(p, inward, radius, slack);
    }
    bool hasWalls() const { return !walls_.empty(); }
    bool inside(const Vec3& p) const;
    double depth(const Vec3& p) const;

  private:
    TriangleBvh walls_, sheets_;
    TriangleBvh shells_;  ///< closed shells including their buried faces; empty if there are none of those
};

}  // namespace touchstone
