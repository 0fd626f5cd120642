#pragma once
// The leaf pairs that may touch for a while: found by one walk, retested every tick.
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "haptics/collision/far_rows.hpp"
#include "haptics/collision/pair_finder.hpp"
#include "haptics/qp/problem.hpp"

namespace touchstone {

/// Identity of a contact, stable over ticks and ascending in the order rows are given.
constexpr std::uint64_t contactId(int obstacle, int toolLeaf, int obstacleLeaf) {
    return std::uint64_t(obstacle) << 56 | std::uint64_t(toolLeaf) << 28 | std::uint64_t(obstacleLeaf);
}
constexpr int obstacleOf(std::uint64_t contact) { return int(contact >> 56); }
constexpr int toolLeafOf(std::uint64_t contact) { return int(contact >> 28 & 0xfffffff); }
constexpr int obstacleLeafOf(std::uint64_t contact) { return int(contact & 0xfffffff); }

/// What crosses a row: the increment x (of C, on world axes: mm, rad) with J x + g + slack |J| < 0, |J| in the metric
/// of the stiffness as elastic answers have it.
struct Crossing {
    Vec6 x = Vec6::Zero();
    Vec6 stiffness = Vec6::Ones();
    double slack = 0;
    double share = 1;  ///< of negative g: a step that goes less far has less to mend
};

/// The pairs of a tool and one obstacle. It holds two sets of entries: all of a wide margin, from a walk of the trees
/// along where the tool goes, and those of a narrow one, taken from the first in one pass, which is what the queries
/// look at. What they return depends on the pose and margin asked for, never on the age of either, nor on who found
/// them. Poses X_OT: tool node in the obstacle's frame, mm. Real time: all memory is taken in the constructor; no lock,
/// no throw.
class NeighborList {
  public:
    NeighborList(const SphereTree& tool, const SphereTree& obstacle, int obstacleIndex);

    /// Makes the list complete for what is asked; what has to be found anew for that reaches up to `slack` further.
    /// False if there are more entries than memory; the list is then complete for nothing.
    bool complete(const Coverage& asked, double slack);
    bool isComplete(const Coverage& asked) const { return finder_.reserve(near_, asked) >= 0; }
    /// What a step may cross, and what it may end in touch of, of the pairs with gap <= margin before it: far less than
    /// those where leaves are large against the way.
    Coverage crossing(const Course& step, double margin) const;
    /// The way of the tool's centre and about it in one tick, on the obstacle's axes, mm and rad, if it goes on as it
    /// does: what is found anew is found that way ahead.
    void expect(const Vec3& shift, const Vec3& turn) { shift_ = shift, turn_ = turn; }
    void forget() { all_.within = near_.within = farHas_.within = {}; }
    /// Entries that complete() may take instead of finding its own, until the next call; null for none. They stay the
    /// caller's.
    void offer(const PairEntries* entries) { offered_ = entries; }

    /// Appends a row (n, r x n), gap for every pair with gap <= margin, ordered by identity. n points from the
    /// obstacle's centre to the tool's, r from C to the tool leaf's centre, both on world axes (R_WO: obstacle frame to
    /// world); pairs of coincident centres have n = 0. Returns false, with the rows as they were, if they would not
    /// fit or be more than `most`. All queries: pre: complete for the margin at the pose.
    bool appendRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows,
                    int most = std::numeric_limits<int>::max()) const;
    /// Of the pairs with gap <= margin: appends rows that `by` crosses by more than a rounding and `rows` has not, the
    /// most crossed ones, to `crossed`; none if and only if there are none. False, with `crossed` as it was, if they
    /// would not fit into `rows` or there are too many to look at. Pre: as for the others, or complete for the
    /// crossing() with the way `by` as step.
    bool appendCrossed(const Pose& X_OT, const Mat3& R_WO, double margin, const Crossing& by, const RowSet& rows,
                       RowSet& crossed);
    /// Appends only the pair of least gap of each tool leaf, as long as they fit; returns the number of pairs within
    /// margin.
    int appendNearestRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows) const;

    /// Whether a pair has a gap below the margin; none if no entries at hand are complete for it. For any margin.
    std::optional<bool> anyWithin(const Pose& X_OT, double margin) const;

    /// What a move did to the listed pairs.
    struct Overlap {
        int toolLeaf = -1, obstacleLeaf = -1;  ///< a pair that got deeper, none if -1
        double depth = 0;                      ///< greatest overlap after, mm; of pairs seen before that one
        bool deeper() const { return toolLeaf >= 0; }
    };
    /// Re-measures the listed pairs after a move until one is deeper: its gap is below min(its gap before, -tolerance).
    /// Pre: complete for the crossing() on the way, with its length as margin.
    Overlap remeasure(const Pose& before, const Pose& after, double tolerance);
    /// Whether that pair is deeper.
    bool isDeeper(const Pose& before, const Pose& after, const Overlap& pair, double tolerance) const;

    /// Exact gap of one pair at X_OT, mm.
    double gap(const Pose& X_OT, int toolLeaf, int obstacleLeaf) const;

  private:
    /// Appends the row of one pair if its gap is within margin.
    void appendRow(const Pose& X_OT, const Mat3& R_WO, double margin, int toolLeaf, int obstacleLeaf,
                   RowSet& rows) const;
    Course ahead(const Course& course, double ticks, double slack) const;
    bool findFar(const Course& step, double margin);
    bool farHas(const Coverage& asked) const;
    float farError(const Course& step) const;
    template <class Visit>
    void forEachHit(const PairEntries& entries, const Pose& X_OT, double margin, Visit&& visit) const;

    const SphereTree* tool_;
    const SphereTree* obstacle_;
    LeafExtent extent_;
    double meanSum_;  ///< of the radii of a pair
    Vec3 shift_ = Vec3::Zero(), turn_ = Vec3::Zero();
    int obstacleIndex_;
    PairFinder finder_;
    PairEntries all_, near_;
    const PairEntries* offered_ = nullptr;
    FarRows far_;
    Coverage farHas_;  ///< rows of these pairs, at its pose
};

}  // namespace touchstone
