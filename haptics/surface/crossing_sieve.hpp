#pragma once
// Leaves out most of the pairs of features that a step cannot cross, eight at a time.
#include "haptics/surface/feature_lanes.hpp"

namespace touchstone {

/// The kinds of pairs: a vertex of the tool and a face of the obstacle, a face and a vertex, two edges.
enum class PairKind : std::int32_t { VertexFace, FaceVertex, EdgeEdge };

/// The tests of touchstone::crossing() in float, widened by its rounding, for the step of a tool between two poses
/// along the straight paths of FeatureList: a pair that is left out has no crossing. Real time.
class CrossingSieve {
  public:
    /// Poses X_OT: tool node in the obstacle's frame, mm. turn: angle between them, rad. least: of the crossing, mm.
    /// guard: bound on the error of a point in float, mm. inside: of the crossing.
    CrossingSieve(const Surface& tool, const Surface& obstacle, const Pose& before, const Pose& after, double turn,
                  double least, float guard, double inside);
    /// Those of eight pairs of a kind that the step may cross. ours, others: features of the tool and the obstacle.
    simd::Mask test(PairKind kind, const int* ours, const int* others) const;

  private:
    simd::Mask crosses(const Vec8& from, const Vec8& to, const FaceLanes& face, float turn) const;
    simd::Mask vertexFaces(const int* vertices, const int* faces) const;
    simd::Mask facesVertex(const int* faces, const int* vertices) const;
    simd::Mask edges(const int* edges, const int* others) const;
    simd::Mask standing(simd::Mask of, const Surface& part, const int* vertices, const Vec8& normals) const;

    const Surface &tool_, &obstacle_;
    Eigen::Matrix3f R0_, R1_;
    Eigen::Vector3f t0_, t1_;  ///< from the obstacle's center to the tool's
    float guard_;
    float pointGuard_;  ///< bound on the error of a point alone, without that of long edges and faces
    float edgeGuard_;   ///< bound on the error of the difference of two points of a part
    float least_, below_, apart_;
    float behind_, rise_;  ///< how deep a vertex may begin behind a face or beside it, and how far it may rise
    float turn_;           ///< of the step, rad
};

}  // namespace touchstone
