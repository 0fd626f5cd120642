#include "haptics/surface/crossing_sieve.hpp"

#include <algorithm>
#include <bit>

#include "haptics/math/tick_tuning.hpp"
#include "haptics/surface/feature_crossing.hpp"

namespace touchstone {

using namespace simd;
using Eigen::Matrix3f;

CrossingSieve::CrossingSieve(const Surface& tool, const Surface& obstacle, const Pose& before, const Pose& after,
                             double turn, double least, float guard, double inside)
    : tool_(tool),
      obstacle_(obstacle),
      R0_(before.R().cast<float>()),
      R1_(after.R().cast<float>()),
      t0_((before * tool.extent.center - obstacle.extent.center).cast<float>()),
      t1_((after * tool.extent.center - obstacle.extent.center).cast<float>()),
      guard_(guard),
      pointGuard_(float(0x1p-24 * (10 * tool.extent.reach + 2 * obstacle.extent.reach) + 1e-7) +
                  0x3p-24f * std::max(t0_.norm(), t1_.norm())),
      edgeGuard_(0x2p-24f * float(std::max(tool.extent.reach, obstacle.extent.reach))),
      least_(float(least) + guard),
      below_(1.0001f * float(std::max(least, inside)) + 1e-8f),
      apart_(2.1001f * float(std::max(least, inside)) + 1e-8f),
      behind_(guard + float(inside)),
      rise_(guard + float(inside > 0 ? inside + least : 0)),
      turn_(float(turn + (inside > 0 ? kLean : 0)) * 1.00001f + 1e-8f) {}

/// Which of these vertices may cross their face, on these paths in a frame that turns by this angle.
TOUCHSTONE_INLINE Mask CrossingSieve::crosses(const Vec8& from, const Vec8& to, const FaceLanes& face,
                                              float turn) const {
    const Vec8 corners[3] = {face.a, face.b, face.c}, path = to - from;
    const Float8 before = dot(face.normal, from - face.a), change = dot(face.normal, path);
    Int8 may = (before + change < least_) & (change <= rise_) & (before >= -behind_);
    if (!toMask(may)) return 0;
    Float8 enters = splat(0.0f), leaves = splat(1.0f);
    const Float8 off = behind_ + float(sagOf(turn, 1)) * simd::sqrt(dot(path, path));
    for (int k = 0; k < 3; ++k) {
        const Vec8 side = corners[(k + 1) % 3] - corners[k], inward = cross(face.normal, side);
        const Float8 wide = off * (abs(side.x) + abs(side.y) + abs(side.z));
        const Float8 first = dot(inward, from - corners[k]) + wide, last = first + dot(inward, path);
        may &= (first >= 0.0f) | (last >= 0.0f);
        const Float8 border = first / (first - last);
        enters = first < 0.0f ? max(enters, border) : enters;
        leaves = last < 0.0f ? min(leaves, border) : leaves;
    }
    may &= (enters <= leaves + 1e-5f) & (before + enters * change >= -off) & (before + leaves * change < least_);
    return toMask(may);
}

/// Those whose spokes all rise above the face with this normal, on the axes of their part before the step, up to the
/// angle of the step, by which the normal also turns.
TOUCHSTONE_INLINE Mask CrossingSieve::standing(Mask of, const Surface& part, const int* vertices,
                                               const Vec8& normals) const {
    const float least = -2 * turn_ - 1e-5f;
    Mask standing = 0;
    for (; of; of &= of - 1) {
        const int i = std::countr_zero(of);
        const SurfaceFeatures::Vertex& vertex = part.features.vertices[vertices[i]];
        const Eigen::Vector3f normal(normals.x[i], normals.y[i], normals.z[i]);
        int k = vertex.firstSpoke;
        const int end = k + vertex.spokes;
        while (k < end && part.spokes[k].dot(normal) >= least) ++k;
        standing |= Mask(k == end) << i;
    }
    return standing;
}

Mask CrossingSieve::vertexFaces(const int* vertices, const int* faces) const {
    const Vec8 arms = verticesOf(tool_, vertices);
    const FaceLanes lanes(Eight(obstacle_.faces, faces));
    return standing(crosses(R0_ * arms + Vec8(t0_), R1_ * arms + Vec8(t1_), lanes, 0), tool_, vertices,
                    R0_.transpose() * lanes.normal);
}

Mask CrossingSieve::facesVertex(const int* faces, const int* vertices) const {
    const Vec8 at = verticesOf(obstacle_, vertices);
    const Matrix3f back0 = R0_.transpose(), back1 = R1_.transpose();
    const FaceLanes lanes(Eight(tool_.faces, faces));
    return standing(crosses(back0 * (at - Vec8(t0_)), back1 * (at - Vec8(t1_)), lanes, turn_), obstacle_, vertices,
                    R0_ * lanes.normal);
}

Mask CrossingSieve::edges(const int* edges, const int* others) const {
    const Eight mine(tool_.edges, edges), theirs(obstacle_.edges, others);
    const EdgeLanes ours = EdgeLanes::ends(mine), resting = EdgeLanes::ends(theirs);
    const EdgeLanes from = R0_ * ours, to = R1_ * ours;
    const Vec8 a0 = from.first + Vec8(t0_), a1 = from.second + Vec8(t0_), b0 = to.first + Vec8(t1_),
               b1 = to.second + Vec8(t1_);
    const Float8 wide = splat(2 * least_ + behind_ - guard_);
    const auto meet = [&](const Float8& p, const Float8& q, const Float8& r, const Float8& s, const Float8& lo,
                          const Float8& hi) {
        return (min(min(p, q), min(r, s)) - wide <= max(lo, hi)) & (max(max(p, q), max(r, s)) + wide >= min(lo, hi));
    };
    const Vec8 &r0 = resting.first, &r1 = resting.second;
    Int8 may = meet(a0.x, a1.x, b0.x, b1.x, r0.x, r1.x) & meet(a0.y, a1.y, b0.y, b1.y, r0.y, r1.y) &
               meet(a0.z, a1.z, b0.z, b1.z, r0.z, r1.z);
    if (!toMask(may)) return 0;
    // As linesStayApart(). With points that are off by g, the arm w is by 2 g. The edges are the differences of points
    // as they are stored, which are off by e in all, and u is also, by 11 roundings of its rotation. So their cross
    // product is off by e (|u| + |v|) and 16 roundings of |u| |v|, and the volume by |w| times that and 2 g |u| |v|,
    // its own rounding included.
    const Vec8 along = ours.second - ours.first, u0 = R0_ * along, u1 = R1_ * along, v = r1 - r0, w0 = a0 - r0,
               w1 = b0 - r0;
    const Vec8 c0 = cross(u0, v), c1 = cross(u1, v);
    const Float8 first = dot(c0, w0), last = dot(c1, w1), middle = 0.5f * (dot(c0, w1) + dot(c1, w0));
    const Float8 lowest = min(min(first, middle), last), highest = max(max(first, middle), last);
    const Float8 lu = simd::sqrt(dot(u0, u0)), lv = simd::sqrt(dot(v, v)), length = lu + lv;
    const Float8 far = simd::sqrt(max(dot(w0, w0), dot(w1, w1))), from2 = dot(c0, c0), to2 = dot(c1, c1);
    const Float8 size2 = max(from2, to2),
                 error = 3.0f * pointGuard_ * lu * lv +
                         1.1f * (far + splat(apart_)) * (edgeGuard_ * length + 0x20p-24f * lu * lv);
    const Float8 apart = max(lowest, -highest) - error, end = abs(last) - error;
    const Vec8 sum = c0 + c1;
    const auto within = [](const Float8& volume, float distance, const Float8& length2) {
        return (volume <= 0.0f) | (volume * volume <= distance * distance * length2);
    };
    may &= within(apart, 0.5f * below_, dot(sum, sum)) | within(end, below_, to2);
    if (!toMask(may)) return 0;
    // The faces of both edges are behind the normal, up to the angle of the step, by which the cross product changes,
    // too.
    const EdgeLanes wings = R0_ * EdgeLanes::wings(mine), otherWings = EdgeLanes::wings(theirs);
    const Float8 m0 = dot(wings.first, c0), m1 = dot(wings.second, c0), n0 = dot(otherWings.first, c0),
                 n1 = dot(otherWings.second, c0);
    const Float8 limit = turn_ * (simd::sqrt(size2) + lu * lv) + 1e-6f * lu * lv + 4.0f * pointGuard_ * length;
    may &= ((min(m0, m1) >= -limit) & (max(n0, n1) <= limit)) | ((max(m0, m1) <= limit) & (min(n0, n1) >= -limit));
    if (!toMask(may)) return 0;
    // At the end the points that met are nearer than allowed. Along the common normal of the end, which differs by the
    // turn divided by the sine between the edges from that of the time when they met, they are as far as the lines.
    const Vec8 paths[2] = {b0 - a0, b1 - a1};
    const Float8 moved = simd::sqrt(max(dot(paths[0], paths[0]), dot(paths[1], paths[1]))) + splat(apart_);
    const Float8 bent = 2.0f * turn_ * lu * lv * moved * simd::sqrt(size2 / min(from2, to2));
    const Float8 side = n0 + n1, above = (side > 0.0f ? -last : last) - error;
    may &= ~((abs(side) > 2.0f * limit) & (above > 1.0001f * (below_ * simd::sqrt(to2) + bent)));
    return toMask(may);
}

Mask CrossingSieve::test(PairKind kind, const int* ours, const int* others) const {
    return kind == PairKind::VertexFace   ? vertexFaces(ours, others)
           : kind == PairKind::FaceVertex ? facesVertex(ours, others)
                                          : edges(ours, others);
}

}  // namespace touchstone
