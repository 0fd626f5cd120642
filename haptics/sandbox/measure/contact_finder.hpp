#pragma once
// Finds the contacts of a tick again for display, outside the loop's thread and with memory of its own.
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "haptics/collision/neighbor_list.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/surface/feature_pair_finder.hpp"

namespace touchstone::sandbox {

struct ContactPoint {
    Vec3 p_W = Vec3::Zero();         ///< on the tool's surface, mm
    Vec3 n_W = Vec3::Zero();         ///< unit, from the obstacle to the tool
    double gap = 0;                  ///< mm, negative where two spheres overlap
    double load = 0;                 ///< N along n_W: the exact solver's multiplier on the contact's row
    Vec3 friction_W = Vec3::Zero();  ///< on the tool, N, in the tangent plane
    double coefficient = 0;          ///< of friction, of a contact that carries load
    bool slides = false;             ///< its friction is as great as it can be, in a tick in which contacts slid
};

/// Two leaves and their gap, mm.
struct NearPair {
    int obstacle = 0, toolLeaf = 0, obstacleLeaf = 0;
    double gap = 0;
};

/// Finds the contacts of a world, in the geometry of the settings, and the forces that they carry. Trees of an obstacle
/// that is touched by its mesh may be null. Not for the loop: it allocates, and takes milliseconds if thousands of
/// pairs are near.
class ContactFinder {
  public:
    explicit ContactFinder(std::shared_ptr<const World> world);

    /// Sets where the obstacles are from now on, X_WO by obstacle; at first they are where the world starts them.
    void place(std::span<const Pose> X_WO) { X_WO_.assign(X_WO.begin(), X_WO.end()); }
    const Pose& obstacle(std::size_t i) const { return X_WO_[i]; }

    /// Pairs with gap <= margin mm at the tool pose of the record: of leaves, and of features of meshes at which the
    /// distance of the surfaces has a local minimum. Returns all pairs that carry load; of the others that lie close
    /// together only the nearest. Ordered by decreasing load, then increasing gap; at most `most`. Valid until the next
    /// call. If thousands of pairs are that near, later calls search within a smaller margin.
    std::span<const ContactPoint> find(const TickRecord& record, const Settings& settings, double margin,
                                       int most = 400);
    /// All pairs of leaves with gap <= margin mm at the tool pose, of obstacles that are touched by their spheres in
    /// this geometry; if there are more than 32,768, the nearest of them. Valid until the next call.
    std::span<const NearPair> pairs(const TickRecord& record, Geometry geometry, double margin);

  private:
    struct Load {
        std::uint64_t id;
        Vec3 n_W;
        double newtons;
        Vec3 friction_W = Vec3::Zero();
    };
    bool anyMeshes(Geometry geometry) const;
    void collectLeaves(const TickRecord& record, Geometry geometry, double margin);
    FeaturePairFinder& features(std::size_t obstacle);
    void addLeaves(const TickRecord& record);
    void addFeatures(const TickRecord& record, std::size_t obstacle, double margin);
    void solveLeaves(const TickRecord& record, const Settings& settings);
    void repeatTick(const TickRecord& record, const Settings& settings);
    void thin(int most);

    std::shared_ptr<const World> world_;
    World repeated_;  ///< of repeated ticks, whose friction is that of the tick
    std::vector<Pose> X_WO_;
    double reach_;
    std::vector<std::unique_ptr<NeighborList>> leaves_;         ///< by obstacle, made when first needed
    std::vector<std::unique_ptr<FeaturePairFinder>> features_;  ///< likewise
    RowSet rows_;                                               ///< of the leaves
    std::unique_ptr<Solver> solver_;                            ///< of the leaves' rows
    std::unique_ptr<TickState> state_;                          ///< repeats ticks between meshes
    std::vector<Load> loads_;                                   ///< of the repeated tick
    double marginShare_ = 1;                                    ///< share of the margin within which find() searches
    int found_ = 0;                                             ///< pairs of the last search
    std::uint64_t tick_ = 0;                                    ///< tick of the last search
    std::vector<ContactPoint> contacts_;
    std::vector<std::pair<std::uint64_t, int>> cells_;  ///< cell and index of each contact
    std::vector<NearPair> pairs_;
};

}  // namespace touchstone::sandbox
