#pragma once
// The contacts of a tick, found again for display: off the loop's thread and with its own memory.
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "haptics/collision/neighbor_list.hpp"
#include "haptics/loop/step.hpp"

namespace touchstone::sandbox {

struct ContactPoint {
    Vec3 p_W = Vec3::Zero();  ///< on the tool's surface, mm
    Vec3 n_W = Vec3::Zero();  ///< unit, from the obstacle to the tool
    double gap = 0;           ///< mm, negative where the two overlap
    double load = 0;          ///< N along n_W, of the exact solver on these rows
};

/// Two leaves and their gap, mm.
struct NearPair {
    int obstacle = 0, toolLeaf = 0, obstacleLeaf = 0;
    double gap = 0;
};

/// Finds the leaf pairs of a world that touch, or nearly, and what they carry. Not for the loop: milliseconds when
/// thousands of pairs are near, and it allocates.
class ContactFinder {
  public:
    explicit ContactFinder(std::shared_ptr<const World> world);

    /// Where the obstacles are from now on, X_WO by obstacle; at first where the world starts them.
    void place(std::span<const Pose> X_WO) { X_WO_.assign(X_WO.begin(), X_WO.end()); }
    const Pose& obstacle(std::size_t i) const { return X_WO_[i]; }

    /// Pairs with gap <= margin mm at the graphic tool's pose of the record. Of those that lie close together only the
    /// nearest is returned, and all that carry load; by falling load, then rising gap, at most `most`. Valid until the
    /// next call. Where thousands of pairs are that near, later ticks are looked at within less.
    std::span<const ContactPoint> find(const TickRecord& record, const Settings& settings, double margin,
                                       int most = 400);
    /// All pairs with gap <= margin mm at the graphic tool's pose, the nearest 32,768 where there are more of them.
    /// Valid until the next call.
    std::span<const NearPair> pairs(const TickRecord& record, double margin);

  private:
    void collect(const TickRecord& record, double margin);
    void thin(int most);

    std::shared_ptr<const World> world_;
    std::vector<Pose> X_WO_;
    double reach_;
    std::vector<NeighborList> lists_;
    RowSet rows_;
    std::unique_ptr<Solver> solver_;
    double share_ = 1;        ///< of the margin that find() looks within
    int found_ = 0;           ///< rows, there
    std::uint64_t tick_ = 0;  ///< that it was asked of
    std::vector<ContactPoint> contacts_;
    std::vector<std::pair<std::uint64_t, int>> cells_;  ///< of the contacts
    std::vector<NearPair> pairs_;
};

}  // namespace touchstone::sandbox
