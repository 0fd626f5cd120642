#pragma once
// Where a step would bring two features too near: the constraints of exact contact.
#include <array>
#include <optional>

#include "haptics/builder/triangle_bvh.hpp"
#include "haptics/surface/surface_features.hpp"

namespace touchstone {

/// The path of a point during a step, a straight line: an arc of angle a bends by less than radius a²/8 from it.
struct PointPath {
    Vec3 from, to;
    Vec3 at(double t) const { return from + t * (to - from); }
};

/// A convex edge, and for each of its two faces the direction of unit length from the edge into the face.
struct EdgePlace {
    std::array<Vec3, 2> ends;
    std::array<Vec3, 2> wings;
};
EdgePlace edgePlaceOf(const SurfaceFeatures& surface, const SurfaceFeatures::Edge& edge);

/// A pair of features that a step brings nearer than allowed. Lengths in mm, in the frame of the resting feature.
struct FeatureCrossing {
    double time;        ///< fraction of the step at which they are too near, in [0, 1]
    Vec3 normal;        ///< of unit length, from the resting feature to the moving one at that time
    Vec3 point;         ///< where they meet
    double after;       ///< signed distance along the normal at the end of the step
    double before = 0;  ///< ... and at its start
};

/// The crossing of a vertex on its path and a resting face with this outward normal: over the part of the path on which
/// the vertex is above or below the face, its distance from the plane begins at zero or more and falls below `least`.
/// inside: a vertex that begins up to as deep behind the face, or as far beside it, crosses it unless it ends at
/// `least` or more. sag: distance by which the vertex may leave its straight path between the ends, mm.
std::optional<FeatureCrossing> crossing(const PointPath& vertex, const Triangle& face, const Vec3& normal, double least,
                                        double inside = 0, double sag = 0);

/// Distance by which a point leaves a straight path of this length in a frame that turns by this angle meanwhile, while
/// it moves straight in the frame that rests, to second order. All of a step has to be one motion, or something passes
/// between features that are tested in one frame and those that are tested in the other.
constexpr double sagOf(double turn, double length) { return turn * length / 4; }

/// The crossing of two convex edges, of which the first one moves: ends[k] is the path of the end k, and `moving` its
/// place at the start. During the step the distance of the two lines falls below `least` from zero or more, at points
/// inside both edges, along a normal that has the faces of both edges behind it. `turn`: angle of the step, rad, by
/// which these may fail to be behind it, since a pair that is first at one time of the step is not at another; 0.1 and
/// more finds pairs that cannot touch. inside: as for a vertex.
std::optional<FeatureCrossing> crossing(const std::array<PointPath, 2>& ends, const EdgePlace& moving,
                                        const EdgePlace& resting, double turn, double least, double inside = 0);

/// Whether the lines of two edges, of which the first one moves, stay farther apart than crossing() allows. A quick
/// test that leaves out most pairs.
bool linesStayApart(const std::array<PointPath, 2>& ends, const std::array<Vec3, 2>& resting, double least);

/// The row J x >= -gap on the increment x of a tool whose moving feature crosses: mm and rad, on the axes of the
/// resting feature's frame. C: the path of the tool's center. With the step itself as x the row gives the distance
/// after it, so that what the turn bends is included.
struct CrossingRow {
    Vec6 row;    ///< n, r x n
    double gap;  ///< mm, less the distance that is kept
};
CrossingRow rowOf(const FeatureCrossing& crossing, const PointPath& C, const Vec6& step, double kept);

}  // namespace touchstone
