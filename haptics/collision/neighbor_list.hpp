#pragma once
// The leaf pairs that may touch in the next ticks: one walk finds them, every tick tests them again.
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "haptics/collision/candidate_rows.hpp"
#include "haptics/collision/pair_finder.hpp"
#include "haptics/qp/problem.hpp"

namespace touchstone {

/// Identity of a contact: stable over ticks, and ascending in the order of the rows.
constexpr std::uint64_t contactId(int obstacle, int toolLeaf, int obstacleLeaf) {
    return std::uint64_t(obstacle) << 56 | std::uint64_t(toolLeaf) << 28 | std::uint64_t(obstacleLeaf);
}
constexpr int obstacleOf(std::uint64_t contact) { return int(contact >> 56); }
constexpr int toolLeafOf(std::uint64_t contact) { return int(contact >> 28 & 0xfffffff); }
constexpr int obstacleLeafOf(std::uint64_t contact) { return int(contact & 0xfffffff); }

/// The step whose crossed rows are wanted. The increment x (of C, on world axes: mm, rad) crosses a row if
/// J x + share g + slack |J| < 0 for g < 0, or J x + g + slack |J| < 0 for g >= 0. |J| is the row's length in the
/// metric of the stiffness, in which elastic answers have their slack.
struct Crossing {
    Vec6 x = Vec6::Zero();
    Vec6 stiffness = Vec6::Ones();
    double slack = 0;
    double share = 1;  ///< factor on negative g: a part of a step has to resolve only the same part of an overlap
};

/// The pairs of a tool and one obstacle. The list holds two sets of entries. The wide set comes from a walk of the
/// trees along the expected motion of the tool; the narrow set, which the queries read, is selected from the wide set
/// in one pass. A query depends only on the pose and margin that it is given, not on the age of either set nor on the
/// thread that found them. Poses X_OT: tool node in the obstacle's frame, mm. Real time: the constructor takes all
/// memory; no lock, no throw.
class NeighborList {
  public:
    NeighborList(const SphereTree& tool, const SphereTree& obstacle, int obstacleIndex);

    /// Makes the list complete for `asked`. If this needs a new search, the search covers up to `slack` mm more.
    /// Returns false if there are more entries than memory; the list is then complete for no coverage.
    bool complete(const Coverage& asked, double slack);
    bool isComplete(const Coverage& asked) const { return finder_.reserve(narrow_, asked) >= 0; }
    /// Of the pairs with gap <= margin before a step: those that the step may cross or that may touch at its end. These
    /// are far fewer if the leaves are large compared with the step.
    Coverage crossing(const Course& step, double margin) const;
    /// The expected motion of one tick: translation of the tool's center and rotation about it, on the obstacle's axes,
    /// mm and rad. Searches look ahead along this motion.
    void expect(const Vec3& shift, const Vec3& turn) { shift_ = shift, turn_ = turn; }
    void forget() { wide_.within = narrow_.within = candidateCoverage_.within = {}; }
    /// Entries that complete() may use instead of searching, until the next call; null for none. The caller keeps
    /// ownership.
    void offer(const PairEntries* entries) { offered_ = entries; }

    /// Appends a row (n, r x n), gap for every pair with gap <= margin, ordered by identity. n points from the
    /// obstacle leaf's center to the tool leaf's, r from C to the tool leaf's center, both on world axes (R_WO:
    /// obstacle frame to world); pairs with coincident centers have n = 0. Returns false and leaves `rows` unchanged if
    /// there would be more than `maxRows` rows or more than fit. Precondition of all queries: the list is complete for
    /// the margin at the pose.
    bool appendRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows,
                    int maxRows = std::numeric_limits<int>::max()) const;
    /// Of the pairs with gap <= margin that have no row in `rows`: appends rows that `by` crosses by more than rounding
    /// to `crossed`. It appends those that are crossed furthest, and none only if none is crossed. Returns false and
    /// leaves `crossed` unchanged if they would not fit into `rows` or there are too many candidates. Pre: as for the
    /// other queries, or the list is complete for the crossing() of the step `by`.
    bool appendCrossed(const Pose& X_OT, const Mat3& R_WO, double margin, const Crossing& by, const RowSet& rows,
                       RowSet& crossed);
    /// Appends only the pair with the smallest gap of each tool leaf, as long as rows fit. Returns the number of all
    /// pairs within the margin.
    int appendNearestRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows) const;

    /// Whether a pair has a gap below the margin; no value if no entries are complete for it. Has no precondition.
    std::optional<bool> anyWithin(const Pose& X_OT, double margin) const;

    /// The overlaps of the listed pairs after a move.
    struct Overlap {
        int toolLeaf = -1, obstacleLeaf = -1;  ///< a pair that got deeper; -1: none
        double depth = 0;                      ///< greatest overlap after the move, mm, of the pairs up to that one
        bool deeper() const { return toolLeaf >= 0; }
    };
    /// Measures the listed pairs after a move until one is deeper, which means that its gap is below min(its gap
    /// before, -tolerance). Pre: the list is complete for the crossing() of the move, with the move's length as margin.
    Overlap remeasure(const Pose& before, const Pose& after, double tolerance);
    /// Whether the move makes this pair deeper.
    bool isDeeper(const Pose& before, const Pose& after, const Overlap& pair, double tolerance) const;

    /// Exact gap of one pair at X_OT, mm.
    double gap(const Pose& X_OT, int toolLeaf, int obstacleLeaf) const;

  private:
    /// Appends the row of one pair if its gap is within margin.
    void appendRow(const Pose& X_OT, const Mat3& R_WO, double margin, int toolLeaf, int obstacleLeaf,
                   RowSet& rows) const;
    Course ahead(const Course& course, double ticks, double slack) const;
    bool collectCandidates(const Course& step, double margin);
    bool hasCandidatesFor(const Coverage& asked) const;
    float candidateError(const Course& step) const;
    template <class Visit>
    void forEachHit(const PairEntries& entries, const Pose& X_OT, double margin, Visit&& visit) const;

    const SphereTree* tool_;
    const SphereTree* obstacle_;
    LeafExtent extent_;
    double meanRadii_;                                 ///< mean sum of the radii of a pair, mm
    Vec3 shift_ = Vec3::Zero(), turn_ = Vec3::Zero();  ///< expected motion of one tick, see expect()
    int obstacleIndex_;
    PairFinder finder_;
    PairEntries wide_, narrow_;
    const PairEntries* offered_ = nullptr;
    CandidateRows candidates_;
    Coverage candidateCoverage_;  ///< the pairs in candidates_, whose rows are those at its pose
};

}  // namespace touchstone
