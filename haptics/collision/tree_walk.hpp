#pragma once
// Two sphere trees against each other, level by level.
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "haptics/collision/sphere_tree.hpp"

namespace touchstone {

/// Where a tool goes for a while: from a pose straight on, as far as known. Tool node in the obstacle's frame; the way
/// is that of the tool's centre and about it, on the obstacle's axes: mm, rad.
struct Course {
    Pose X_OT;
    Vec3 shift = Vec3::Zero(), turn = Vec3::Zero();

    Course() = default;
    Course(const Pose& X_OT_) : X_OT(X_OT_) {}  // NOLINT: staying is a course
    Course(const Pose& X_OT_, const Vec3& shift_, const Vec3& turn_) : X_OT(X_OT_), shift(shift_), turn(turn_) {}
    /// The way from one pose to another of a tool with that centre.
    static Course between(const Pose& from, const Pose& to, const Vec3& center) {
        return {from, to * center - from * center, logRotation(to.q * from.q.conjugate())};
    }
    bool stays() const { return shift.isZero(0) && turn.isZero(0); }
    Course times(double k) const { return {X_OT, k * shift, k * turn}; }
    /// Where a tool with that centre is then.
    Pose end(const Vec3& center) const {
        const Quat q = (expRotation(turn) * X_OT.q).normalized();
        return {X_OT * center + shift - q * center, q};
    }
};

/// Which pairs of leaves are meant: those with gap <= margin + curve / (sum of their radii), and <= most. Distances of
/// centres curve the less the larger they are, so what a step may touch is less far away where leaves are large.
struct Within {
    double margin = -1;  ///< mm; negative: none
    double curve = 0;    ///< mm²
    double most = -1;    ///< mm

    Within() = default;
    Within(double margin_) : margin(margin_), most(margin_) {}  // NOLINT: whatever the radii
    Within(double margin_, double curve_, double most_) : margin(margin_), curve(curve_), most(most_) {}
    /// For pairs whose radii make that sum, mm > 0.
    double at(double sum) const { return std::min(most, margin + curve / sum); }
    Within wider(double by) const { return {margin + by, curve, most + by}; }
};

/// Which pairs, and where they are: somewhere on the course.
struct Coverage {
    Course course;
    Within within;
};

/// A tool leaf and a bucket of eight obstacle leaves, [8·bucket, 8·bucket + 8), that may be near each other.
struct LeafBucket {
    std::int32_t toolLeaf;
    std::int32_t bucket;
};

/// Bound on the error, in mm, of a distance computed in float at this pose: added wherever a float test must not miss.
float floatGuard(const SphereTree& tool, const SphereTree& obstacle, const Pose& X_OT);

/// Rounded up.
inline float curveInFloat(const Within& within) { return float(within.curve * (1 + 1e-6)); }

/// Finds the leaf buckets of a coverage. Breadth first in blocks that fit the cache: one tool block (as a sphere)
/// against eight obstacle blocks (as rounded boxes and spheres), or eight tool blocks against one, whichever side has
/// the larger blocks. The schedule is fixed per pair of trees and the memory is taken in the constructor.
class TreeWalk {
  public:
    TreeWalk(const SphereTree& tool, const SphereTree& obstacle);

    /// Calls sink(const LeafBucket*, count) with runs of entries that together hold every leaf pair of the coverage,
    /// margin >= 0. Buckets of one tool leaf arrive in ascending order; tool leaves arrive
    /// in any. Real time: no allocation, lock or throw beyond the sink's own.
    template <class Sink>
    void run(const Coverage& asked, Sink&& sink) {
        runErased(
            asked, [](void* s, const LeafBucket* e, int n) { (*static_cast<Sink*>(s))(e, n); }, &sink);
    }

  private:
    using ErasedSink = void (*)(void*, const LeafBucket*, int);
    struct Frontier {
        std::vector<std::int32_t> tool, obstacle;
    };
    struct Query;

    void runErased(const Coverage& asked, ErasedSink sink, void* context);
    template <bool moves>
    void descend(const Query& query, int depth, int count);
    template <bool moves>
    int expandObstacle(const Query& query, int depth, int first, int count, int& used);
    template <bool moves>
    int expandTool(const Query& query, int depth, int first, int count, int& used);

    const SphereTree* tool_;
    const SphereTree* obstacle_;
    /// levels_[d] = {tool level, obstacle level} of the pairs in frontiers_[d].
    std::vector<std::array<int, 2>> levels_;
    std::vector<Frontier> frontiers_;
    std::vector<LeafBucket> out_;
};

}  // namespace touchstone
