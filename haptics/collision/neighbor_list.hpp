#pragma once
// The contacts of two sphere trees: leaf pairs, of which each within a margin is a row.
#include <vector>

#include "haptics/collision/candidate_rows.hpp"
#include "haptics/collision/contact_list.hpp"

namespace touchstone {

class NeighborList final : public ContactList {
  public:
    /// `center`: the point about which the tool turns, in its own frame, mm.
    NeighborList(const SphereTree& tool, const SphereTree& obstacle, int obstacleIndex, const Vec3& center);
    NeighborList(const SphereTree& tool, const SphereTree& obstacle, int obstacleIndex)
        : NeighborList(tool, obstacle, obstacleIndex, tool.center()) {}

    /// The pairs are far fewer than those within the margin if the leaves are large compared with the step.
    Coverage coverageOf(const StraightMotion& step, double margin) const override;
    bool appendRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows,
                    int maxRows = std::numeric_limits<int>::max()) const override;
    int appendNearestRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows) const override;
    /// Rows of leaf pairs run from leaf center to leaf center; pairs with coincident centers have n = 0.
    Crossed appendCrossed(const Pose& X_OT, const Pose& before, const Mat3& R_WO, double margin, const Crossing& by,
                          RowSet& rows, RowSet& crossed) override;
    Overlap remeasure(const Pose& before, const Pose& after, double tolerance) override;
    Nearest nearest(const Pose& X_OT, int toolLeaf, int obstacleLeaf) const override;
    double freeShare(const StraightMotion& motion, double atMost) override;

  private:
    /// Appends the row of one pair if its gap is within margin.
    void appendRow(const Pose& X_OT, const Mat3& R_WO, double margin, int toolLeaf, int obstacleLeaf,
                   RowSet& rows) const;
    bool collectCandidates(const StraightMotion& step, double margin);
    bool hasCandidatesFor(const Coverage& asked) const;
    float candidateError(const StraightMotion& step) const;
    template <class Visit>
    void forEachHit(const PairEntries& entries, const Pose& X_OT, double margin, Visit&& visit) const;

    const SphereTree* tool_;
    const SphereTree* obstacle_;
    double meanRadii_;  ///< mean sum of the radii of a pair, mm
    int obstacleIndex_;
    CandidateRows candidates_;
    Coverage candidateCoverage_;  ///< the pairs in candidates_, whose rows are those at its pose
};

}  // namespace touchstone
