#pragma once
// Finds the pairs of features of two meshes that may touch in the next ticks.
#include <type_traits>

#include "haptics/collision/pair_finder.hpp"
#include "haptics/surface/crossing_sieve.hpp"
#include "haptics/surface/feature_lanes.hpp"
#include "haptics/surface/surface_distance.hpp"

namespace touchstone {

/// A PairEntry of features: its `tool` holds the kind and the tool's feature, its `obstacle` the obstacle's.
constexpr std::int32_t toolFeature(PairKind kind, int feature) { return std::int32_t(kind) << 26 | feature; }
constexpr PairKind kindOf(std::int32_t tool) { return PairKind(tool >> 26); }
constexpr int featureOf(std::int32_t tool) { return tool & ((1 << 26) - 1); }

/// A pair of features is within a margin if the two come as near as that on the course and their normals can oppose
/// each other there.
class FeaturePairFinder final : public PairFinder {
  public:
    FeaturePairFinder(const Surface& tool, const Surface& obstacle);

    PairEntries entries() const override;
    bool ofFeatures() const override { return true; }
    /// Whatever the settings say, since features are denser than leaves. With a larger one searches are rarer and find
    /// more pairs; measured on the bunnies and the spline.
    double slack(double) const override { return 0.15; }
    float guard(const Pose& X_OT) const override;
    NearestPoints nearest(const Pose& X_OT, const PairEntry& pair) const;  ///< of a pair, in double
    /// Of the entries of a coverage: calls visit(PairEntry) for all that the step of the tool between two poses may
    /// cross (CrossingSieve), until it returns false. Pre: the entries are complete for the coverage.
    template <class Visit>
    void forEachCrossing(const PairEntries& entries, const Coverage& asked, const Pose& before, const Pose& after,
                         double least, Visit&& visit) const {
        crossErased(
            entries, asked, before, after, least,
            [](void* v, const PairEntry& e) { return (*static_cast<std::remove_reference_t<Visit>*>(v))(e); }, &visit);
    }
    /// Calls visit(PairEntry, gap) for all pairs of a coverage until it returns false.
    template <class Visit>
    void forEachPair(const Coverage& asked, Visit&& visit) {
        walkErased(
            asked,
            [](void* v, const PairEntry& e, float gap, const Separation8&, int) {
                return (*static_cast<Visit*>(v))(e, gap);
            },
            &visit);
    }

  private:
    /// The separation of a pair is a lane of eight.
    using ErasedVisit = bool (*)(void*, const PairEntry&, float gap, const Separation8&, int lane);
    using ErasedCrossing = bool (*)(void*, const PairEntry&);
    struct Query;
    struct Swept;
    struct Ends;
    struct Node {
        int height, index;
    };

    bool search(const Coverage& asked, PairEntries& out) override;
    void select(const PairEntries& from, const Coverage& asked, PairEntries& out) override;
    void walkErased(const Coverage& asked, ErasedVisit visit, void* context);
    void crossErased(const PairEntries& entries, const Coverage& asked, const Pose& before, const Pose& after,
                     double least, ErasedCrossing visit, void* context) const;
    template <class Visit>
    void forEachNear(const PairEntries& entries, const Coverage& asked, const Ends& ends, Visit&& visit) const;
    template <class Visit>
    static bool forEachNear(const Query& query, const FeatureTree::Bounds8& nodes, const FeatureTree::Bounds8& boxes,
                            simd::Mask near, Visit&& visit);
    template <class Visit>
    bool descend(const Query& query, FeatureKind kind, FeatureKind other, Node a, const Swept& swept, Node parent,
                 simd::Mask near, Visit& visit);
    template <class Visit>
    bool walk(const Query& query, FeatureKind kind, FeatureKind other, Visit&& visit);

    const Surface* tool_;
    const Surface* obstacle_;
    double leastAbout_;  ///< smallest distance that bounds the travel of a turn, mm
    // Eights of the features of one patch of the tool during a search: their boxes, and of edges the directions and
    // wings.
    AlignedVector<Box8> placed_;
    AlignedVector<std::pair<Vec8, EdgeLanes>> placedEdges_;
};

}  // namespace touchstone
