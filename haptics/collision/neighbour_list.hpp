#pragma once
// The leaf pairs that may touch for a while: found by one walk, retested every tick.
#include <cstdint>
#include <vector>

#include "haptics/collision/tree_walk.hpp"
#include "haptics/qp/problem.hpp"

namespace touchstone {

/// How far any leaf of a tool travels at most between two poses, mm: |δp| + ρ|δθ| about `center`, whose leaves reach
/// `reach`.
double travel(const Pose& from, const Pose& to, const Vec3& center, double reach);

/// Identity of a contact, stable over ticks and ascending in the order rows are given.
constexpr std::uint64_t contactId(int obstacle, int toolLeaf, int obstacleLeaf) {
    return std::uint64_t(obstacle) << 56 | std::uint64_t(toolLeaf) << 28 | std::uint64_t(obstacleLeaf);
}

/// The pairs of a tool and one obstacle. A list built at one pose for margin M holds every pair with gap <= m at any
/// pose within travel M - m of it, since a gap changes by no more than the travel. Lists only hold too much: what the
/// queries return depends on the pose and margin asked for, never on the list's age. Poses X_OT: tool node in the
/// obstacle's frame, mm. Real time: all memory is taken in the constructor; no lock, no throw.
class NeighbourList {
  public:
    static constexpr int kCapacity = 1 << 18;

    NeighbourList(const SphereTree& tool, const SphereTree& obstacle, int obstacleIndex);

    /// Makes the list complete for `margin` at X_OT. False if there are more entries than memory; the list then covers
    /// nothing.
    bool build(const Pose& X_OT, double margin);
    /// True if the list holds every pair with gap <= margin at X_OT.
    bool covers(const Pose& X_OT, double margin) const;
    void forget() { builtMargin_ = -1; }

    /// Appends a row (n, r x n), gap for every pair with gap <= margin, ordered by identity. n points from the
    /// obstacle's centre to the tool's, r from C to the tool leaf's centre, both on world axes (R_WO: obstacle frame to
    /// world); pairs of coincident centres have n = 0. Returns false, with the rows as they were, if they would not
    /// fit.
    bool appendRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows) const;
    /// Appends only the pair of least gap of each tool leaf, as long as they fit; returns the number of pairs within
    /// margin.
    int appendNearestRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows) const;

    struct Overlap {
        bool deeper = false;  ///< some gap is below min(its gap before, -tolerance)
        double depth = 0;     ///< greatest overlap after, mm
    };
    /// Re-measures the listed pairs after a move. Pre: the list covers margin 0 at `after`.
    Overlap remeasure(const Pose& before, const Pose& after, double tolerance) const;

    /// Exact gap of one pair at X_OT, mm.
    double gap(const Pose& X_OT, int toolLeaf, int obstacleLeaf) const;

  private:
    struct Group {
        std::int32_t toolLeaf, begin, end;  ///< buckets_[begin, end)
    };

    void placeToolLeaves(const Pose& X_OT, float margin);
    template <class Visit>
    void forEachHit(const Pose& X_OT, double margin, Visit&& visit) const;

    const SphereTree* tool_;
    const SphereTree* obstacle_;
    Vec3 center_;
    double reach_;
    int obstacleIndex_;
    TreeWalk walk_;

    Pose builtAt_;
    double builtMargin_ = -1;
    int groupCount_ = 0;
    AlignedVector<float> placed_[4];  ///< of build(): x, y, z, reach of each tool leaf
    std::vector<LeafBucket> found_;
    std::vector<std::int32_t> buckets_, offsets_;
    std::vector<Group> groups_;
};

}  // namespace touchstone
