#pragma once
// The pairs of a tool and one obstacle that may touch in the next ticks: one search finds them, every tick tests them
// again. The mechanism is the same for leaves of sphere trees and for features of meshes.
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "haptics/collision/pair_finder.hpp"
#include "haptics/math/tick_tuning.hpp"
#include "haptics/qp/problem.hpp"

namespace touchstone {

/// Identity of a contact: stable over ticks, and ascending in the order of the rows. `tool` and `obstacle`: leaves, or
/// features (haptics/surface).
constexpr std::uint64_t contactId(int obstacleIndex, int tool, int obstacle) {
    return std::uint64_t(obstacleIndex) << 56 | std::uint64_t(tool) << 28 | std::uint64_t(obstacle);
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
    double share = 1;   ///< factor on negative g: a part of a step has to resolve only the same part of an overlap
    bool whole = true;  ///< x is all that this linearization may move; a shorter trial need not end clear
};

/// What a step crosses, in rising order.
enum class Crossed : std::uint8_t {
    Nothing,   ///< no row but those that the solver has and may violate
    Known,     ///< features whose rows the solver has: the step is not clear, and no row is new
    Rows,      ///< rows were appended or replaced
    Overflow,  ///< rows that would not fit, or there are too many candidates; `crossed` is unchanged
};

/// The list holds sets of entries. A wide set comes from a search along the expected motion of the tool; the narrow
/// set, which the queries read, is selected from a wide set in one pass. There are two wide sets, since the trial steps
/// of a tick often lead to and fro between two directions. A query depends only on the pose and margin that it is
/// given, not on the age of any set nor on the thread that found them. Poses X_OT: tool node in the obstacle's frame,
/// mm. R_WO: obstacle frame to world. Real time: the constructors take all memory; no lock, no throw.
class ContactList {
  public:
    virtual ~ContactList() = default;

    /// Makes the list complete for `asked`. If this needs a new search, the search covers up to `slack` mm more.
    /// Returns false if there are more entries than memory or the search took more than its budget; the list is then
    /// complete for no coverage.
    bool complete(const Coverage& asked, double slack);
    bool isComplete(const Coverage& asked) const { return suspended_ || finder_->reserve(narrow_, asked) >= 0; }
    /// Features that begin up to this deep in each other are led out, mm; deeper ones are passed through until they are
    /// apart. 0: none begin so. passes: if a search fails meanwhile, the list is suspended and holds no pairs, so that
    /// the tool, which is deeper inside, passes through the obstacle.
    void beginInside(double depth, bool passes = false) { inside_ = depth, passes_ = passes, suspended_ = false; }
    double inside() const { return inside_; }
    bool suspended() const { return suspended_; }
    /// The motion that is expected for one tick. Searches look ahead along it.
    void expect(const StraightMotion& tick) { tick_ = tick; }
    void forget();
    /// Searches count their work there and end with their part of it; null: no bound. The caller keeps ownership. A
    /// search of a list for leaves is bounded by the memory of its entries alone.
    void use(SearchBudget* budget) {
        budget_ = budget;
        if (ofFeatures()) finder_->use(budget);
    }
    /// Features are kept apart by this distance, mm: a step ends at no less than 0.95 of it, or half of it if it is
    /// shortened. Leaves touch at 0.
    void keepApart(double distance) { distance_ = distance; }
    double distance() const { return distance_; }
    /// Entries that complete() may use instead of searching, until the next call; null for none, and those of another
    /// geometry are not used. The caller keeps ownership.
    void offer(const PairEntries* entries) {
        offered_ = entries && entries->ofFeatures == ofFeatures() ? entries : nullptr;
    }

    /// The pairs with gap <= margin before a step that the step may cross or that may touch at its end.
    virtual Coverage coverageOf(const StraightMotion& step, double margin) const = 0;

    /// Appends a row (n, r x n), gap for every pair with gap <= margin, ordered by identity. n points from the
    /// obstacle to the tool, r from C to the contact, both on world axes. Returns false and leaves `rows` unchanged if
    /// there would be more than `maxRows` rows or more than fit. Features have no such rows. Precondition of all
    /// queries: the list is complete for the margin at the pose.
    virtual bool appendRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows,
                            int maxRows = std::numeric_limits<int>::max()) const = 0;
    /// Appends only the pair with the smallest gap of each tool leaf, as long as rows fit. Returns the number of all
    /// pairs within the margin.
    virtual int appendNearestRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows) const = 0;
    /// Appends to `crossed` the rows of pairs with gap <= margin that `by` crosses by more than rounding. It appends
    /// those that are crossed furthest, and none only if none is crossed. Pairs of leaves that have a row in `rows` are
    /// left out. The row of a pair of features is that of this step, so the one in `rows` is replaced; `before` is
    /// where the step begins for them, which differs from X_OT if the obstacle has moved. Pre: as for the other
    /// queries, or the list is complete for coverageOf() of the step `by`.
    virtual Crossed appendCrossed(const Pose& X_OT, const Pose& before, const Mat3& R_WO, double margin,
                                  const Crossing& by, RowSet& rows, RowSet& crossed) = 0;
    /// The overlaps of the listed pairs after a move.
    struct Overlap {
        bool deeper = false;  ///< a pair got deeper
        double depth = 0;     ///< greatest overlap after the move, mm, of the pairs up to that one
    };
    /// Measures the listed pairs after a move until one is deeper: its gap is below min(its gap before, -tolerance),
    /// or the move brings two features too near. Pre: the list is complete for coverageOf() of the move, with the
    /// move's length as margin.
    virtual Overlap remeasure(const Pose& before, const Pose& after, double tolerance) = 0;

    /// Where one pair is nearest at X_OT, computed from the shapes, in the obstacle's frame, mm.
    struct Nearest {
        Vec3 onTool;
        Vec3 normal;  ///< of unit length, from the obstacle to the tool; 0 if they meet in a point
        double gap;   ///< exact
    };
    virtual Nearest nearest(const Pose& X_OT, int toolLeaf, int obstacleLeaf) const = 0;
    double gap(const Pose& X_OT, int toolLeaf, int obstacleLeaf) const {
        return nearest(X_OT, toolLeaf, obstacleLeaf).gap;
    }

    /// The fraction of a motion, at most `atMost`, up to which nothing touches; pairs that touch at its start must not
    /// get nearer. A lower bound if the tool turns, or if the search ended with its budget. Has no precondition.
    virtual double freeShare(const StraightMotion& motion, double atMost) = 0;

    /// Whether the parts have the features of a pair with this identity.
    virtual bool hasFeatures(std::uint64_t /*pair*/) const { return false; }
    /// How two features stand on each other at X_OT if the face goes on as its plane, or both edges as their lines, as
    /// in their row. In the obstacle's frame, mm.
    struct Stand {
        Vec3 foot = Vec3::Zero();    ///< where they are nearest, on the tool
        Vec3 normal = Vec3::Zero();  ///< of unit length, from the obstacle to the tool
        double height = 0;           ///< distance along the normal
        double beside = 0;  ///< by which foot or normal leaves the features: more than a little stands on nothing
    };
    /// Leaves stand nowhere beside themselves.
    virtual Stand stand(const Pose& /*X_OT*/, std::uint64_t /*pair*/) const { return {}; }
    /// Whether a listed pair stands on its features, up to `within` mm, with the foot and normal of `like`: a pair that
    /// shares a feature with `pair`, of this obstacle or another.
    virtual bool hasTwin(const Pose& /*X_OT*/, std::uint64_t /*pair*/, const Stand& /*like*/, double /*within*/) const {
        return false;
    }
    /// Whether the rows are those of features, which a step crosses or does not; no row stands for a pair that is near.
    virtual bool ofFeatures() const { return false; }

  protected:
    explicit ContactList(std::unique_ptr<PairFinder> finder, const LookAhead& lookAhead = {});
    ContactList(ContactList&&) = default;
    ContactList& operator=(ContactList&&) = default;
    const Extent& extent() const { return finder_->extent(); }
    /// Begins a search whether a motion is free or anything is near.
    void beginFlight() const {
        if (budget_) budget_->beginFlight();
    }

    std::unique_ptr<PairFinder> finder_;
    std::array<PairEntries, 2> wide_;
    PairEntries narrow_;
    const PairEntries* offered_ = nullptr;
    SearchBudget* budget_ = nullptr;
    double distance_ = 0;
    double inside_ = 0;    ///< see beginInside()
    bool passes_ = false;  ///< likewise
    bool suspended_ = false;

  private:
    StraightMotion expected(const StraightMotion& motion, double ticks, double slack) const;

    LookAhead lookAhead_;
    int used_ = 0;         ///< the wide set that served last
    double reach_ = 1;     ///< part of the reserve and the look-ahead, see LookAhead::crowded
    StraightMotion tick_;  ///< see expect()
};

}  // namespace touchstone
