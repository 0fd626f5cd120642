#pragma once
// The leaf pairs that may touch for a while: found by one walk, retested every tick.
#include <cstdint>
#include <limits>
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

/// What crosses a row: the increment x (of C, on world axes: mm, rad) with J x + g + slack |J| < 0, |J| in the metric
/// of the stiffness as elastic answers have it.
struct Crossing {
    Vec6 x = Vec6::Zero();
    Vec6 stiffness = Vec6::Ones();
    double slack = 0;
    bool notDeeper = false;  ///< negative g count as zero
};

/// The pairs of a tool and one obstacle, as entries of a tool leaf and a bucket of obstacle leaves. Entries found at
/// one pose for margin M hold every pair with gap <= m at any pose within travel M - m of it, since a gap changes by no
/// more than the travel. There are two such sets: all entries of a wide margin, from a walk of the trees, and those of
/// a narrow one, taken from the first in one pass, which is what the queries look at. What they return depends on the
/// pose and margin asked for, never on the age of either. Poses X_OT: tool node in the obstacle's frame, mm. Real time:
/// all memory is taken in the constructor; no lock, no throw.
class NeighbourList {
  public:
    static constexpr int kCapacity = 1 << 18;

    NeighbourList(const SphereTree& tool, const SphereTree& obstacle, int obstacleIndex);

    /// Makes the list complete for `margin` at X_OT; what has to be found anew for that reaches up to `slack` further.
    /// False if there are more entries than memory; the list is then complete for nothing.
    bool complete(const Pose& X_OT, double margin, double slack);
    void forget() { all_.margin = near_.margin = -1; }

    /// Appends a row (n, r x n), gap for every pair with gap <= margin, ordered by identity. n points from the
    /// obstacle's centre to the tool's, r from C to the tool leaf's centre, both on world axes (R_WO: obstacle frame to
    /// world); pairs of coincident centres have n = 0. Returns false, with the rows as they were, if they would not
    /// fit or be more than `most`. All queries: pre: complete() for the margin at the pose, or for more nearby.
    bool appendRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows,
                    int most = std::numeric_limits<int>::max()) const;
    /// Of the pairs with beyond < gap <= margin: appends those to `crossed` whose row is crossed by more than a
    /// rounding, but for those that `rows` has. Returns the number of pairs in that range, or -1, with `crossed` as it
    /// was, if they would not fit into `rows`.
    int appendCrossed(const Pose& X_OT, const Mat3& R_WO, double beyond, double margin, const Crossing& by,
                      const RowSet& rows, RowSet& crossed) const;
    /// Appends only the pair of least gap of each tool leaf, as long as they fit; returns the number of pairs within
    /// margin.
    int appendNearestRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows) const;

    /// What a move did to the listed pairs.
    struct Overlap {
        int toolLeaf = -1, obstacleLeaf = -1;  ///< a pair that got deeper, none if -1
        double depth = 0;                      ///< greatest overlap after, mm; of pairs seen before that one
        bool deeper() const { return toolLeaf >= 0; }
    };
    /// Re-measures the listed pairs after a move until one is deeper: its gap is below min(its gap before, -tolerance).
    /// Pre: complete() at `before` for the travel.
    Overlap remeasure(const Pose& before, const Pose& after, double tolerance) const;
    /// Whether that pair is deeper.
    bool isDeeper(const Pose& before, const Pose& after, const Overlap& pair, double tolerance) const;

    /// Exact gap of one pair at X_OT, mm.
    double gap(const Pose& X_OT, int toolLeaf, int obstacleLeaf) const;

  private:
    struct Entries {
        explicit Entries(std::size_t capacity) : at(capacity + 8), gap(capacity + 8) {}
        std::vector<LeafBucket> at;
        AlignedVector<float> gap;  ///< least of the bucket when found, exact to floatGuard()
        int count = 0;
        Pose pose;
        double margin = -1;
    };

    bool walk(const Pose& X_OT, double margin);
    void narrow(const Pose& X_OT, double margin);
    void placeToolLeaves(const Pose& X_OT);
    void keep(LeafBucket entry, float limit, Entries& out) const;
    double reserve(const Entries& entries, const Pose& X_OT) const;
    template <class Visit>
    void forEachWithin(const Entries& entries, const Pose& X_OT, double margin, Visit&& visit) const;
    template <class Visit>
    void forEachHit(const Pose& X_OT, double margin, Visit&& visit) const;

    const SphereTree* tool_;
    const SphereTree* obstacle_;
    Vec3 center_;
    double reach_;
    int obstacleIndex_;
    TreeWalk walk_;

    Entries all_, near_;              ///< all_: ordered by tool leaf, then bucket; so is near_
    AlignedVector<float> placed_[4];  ///< x, y, z, r of each tool leaf, in the obstacle's frame
    std::vector<std::int32_t> offsets_;
};

}  // namespace touchstone
