#pragma once
// Judges whether two closed meshes overlap: an answer that shares no predicate with the library. Made with CGAL.
#include <memory>

#include "haptics/builder/triangle_mesh.hpp"

namespace touchstone::test {

/// Decides by exact predicates, on vertices that are placed in the obstacle's frame and rounded to double: what
/// rounding moves is below 1e-13 of the distance from the origin. Lengths in mm; X_OT is the tool's pose in the
/// obstacle's frame. The triangles are those of the parts' files, before any repair. Immutable once made.
class ExactJudge {
  public:
    ExactJudge(const TriangleMesh& tool, const TriangleMesh& obstacle);
    ~ExactJudge();
    ExactJudge(ExactJudge&&) noexcept;

    /// Number of pairs of triangles that share a point, but at most `atMost`.
    int intersections(const Pose& X_OT, int atMost = 1) const;
    /// Whether a shell of one part lies inside the other part. Pre: no triangles intersect.
    bool contained(const Pose& X_OT) const;
    bool overlap(const Pose& X_OT) const { return intersections(X_OT) > 0 || contained(X_OT); }

  private:
    struct Part;
    std::unique_ptr<const Part> tool_, obstacle_;
};

}  // namespace touchstone::test
