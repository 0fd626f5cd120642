#pragma once
// Finds the near leaf pairs of two sphere trees, level by level.
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "haptics/collision/sphere_tree.hpp"

namespace touchstone {

/// The motion of a tool for some time: a start pose and a straight path from it. X_OT is the tool node in the
/// obstacle's frame; `shift` is the translation of the tool's center and `turn` the rotation about it, on the
/// obstacle's axes: mm, rad.
struct StraightMotion {
    Pose X_OT;
    Vec3 shift = Vec3::Zero(), turn = Vec3::Zero();

    StraightMotion() = default;
    StraightMotion(const Pose& X_OT_)
        : X_OT(X_OT_) {}  // NOLINT: a pose converts to the motion of a tool that does not move
    StraightMotion(const Pose& X_OT_, const Vec3& shift_, const Vec3& turn_)
        : X_OT(X_OT_), shift(shift_), turn(turn_) {}
    /// The motion from one pose to another of a tool with this center.
    static StraightMotion between(const Pose& from, const Pose& to, const Vec3& center) {
        return {from, to * center - from * center, logRotation(to.q * from.q.conjugate())};
    }
    bool operator==(const StraightMotion& other) const {
        return X_OT == other.X_OT && shift == other.shift && turn == other.turn;
    }
    bool stays() const { return shift.isZero(0) && turn.isZero(0); }
    StraightMotion times(double k) const { return {X_OT, k * shift, k * turn}; }
    /// The pose at the end, for a tool with this center.
    Pose end(const Vec3& center) const {
        const Quat q = (expRotation(turn) * X_OT.q).normalized();
        return {X_OT * center + shift - q * center, q};
    }
};

/// A set of leaf pairs: those with gap <= min(margin + curve / (sum of their radii), most). The distance of two centers
/// curves less along a step if it is large, so large leaves that a step may touch are nearer than small ones.
struct Within {
    double margin = -1;  ///< mm; negative: no pairs
    double curve = 0;    ///< mm²
    double most = -1;    ///< upper bound on the gap, mm
    /// For features: the largest turn of a step that they serve, rad. Their normals turn with the tool, so that a pair
    /// which cannot oppose each other now may do so in a step.
    double turn = std::numeric_limits<double>::infinity();

    Within() = default;
    Within(double margin_) : margin(margin_), most(margin_) {}  // NOLINT: a margin converts, the same for all radii
    Within(double margin_, double curve_, double most_, double turn_ = std::numeric_limits<double>::infinity())
        : margin(margin_), curve(curve_), most(most_), turn(turn_) {}
    /// The largest gap for pairs with this sum of radii, mm; sum > 0.
    double at(double sum) const { return std::min(most, margin + curve / sum); }
    Within wider(double by) const { return {margin + by, curve, most + by, turn}; }
};

/// The pairs that are within somewhere on the motion.
struct Coverage {
    StraightMotion motion;
    Within within;
};

/// A tool leaf and a bucket of eight obstacle leaves, [8·bucket, 8·bucket + 8), that may be near it.
struct PairEntry {
    std::int32_t tool;
    std::int32_t obstacle;
};

/// Bound on the error of a distance computed in float at this pose, mm. It is added wherever a float test must not miss
/// a pair.
float floatGuard(const SphereTree& tool, const SphereTree& obstacle, const Pose& X_OT);

/// The curve term rounded up to float.
inline float curveInFloat(const Within& within) { return float(within.curve * (1 + 1e-6)); }

/// Finds the leaf buckets of a coverage. The walk is breadth first in runs that fit the cache. It tests one tool block
/// (as a sphere) against eight obstacle blocks (as rounded boxes and spheres), or eight tool blocks against one; the
/// side with the larger blocks is split. The order of levels is fixed for a pair of trees, and the constructor takes
/// all memory.
class TreeWalk {
  public:
    TreeWalk(const SphereTree& tool, const SphereTree& obstacle);

    /// Calls sink(const PairEntry*, count) with runs of entries that together hold every leaf pair of the coverage.
    /// Pre: margin >= 0. The buckets of one tool leaf arrive in ascending order; the tool leaves arrive in any order.
    /// Real time: no allocation, lock or throw except in the sink.
    template <class Sink>
    void run(const Coverage& asked, Sink&& sink) {
        runErased(
            asked, [](void* s, const PairEntry* e, int n) { (*static_cast<Sink*>(s))(e, n); }, &sink);
    }

  private:
    using ErasedSink = void (*)(void*, const PairEntry*, int);
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
    std::vector<PairEntry> out_;  ///< the run that is passed to the sink
};

}  // namespace touchstone
