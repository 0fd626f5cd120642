#pragma once
// Finds the pairs of features of two meshes that may touch in the next ticks.
#include <bit>
#include <span>
#include <type_traits>

#include "haptics/collision/pair_finder.hpp"
#include "haptics/surface/crossing_sieve.hpp"
#include "haptics/surface/feature_lanes.hpp"
#include "haptics/surface/surface_distance.hpp"

namespace touchstone {

/// A PairEntry of features: its `tool` holds the kind and the tool's feature, its `obstacle` the obstacle's.
constexpr int kFeatureBits = 26;
constexpr std::int32_t toolFeature(PairKind kind, int feature) { return std::int32_t(kind) << kFeatureBits | feature; }
constexpr PairKind kindOf(std::int32_t tool) { return PairKind(tool >> kFeatureBits); }
constexpr int featureOf(std::int32_t tool) { return tool & ((1 << kFeatureBits) - 1); }

/// A pair of features is within a margin if the two come as near as that on the motion and their normals can oppose
/// each other there.
class FeaturePairFinder final : public PairFinder {
  public:
    FeaturePairFinder(const Surface& tool, const Surface& obstacle);

    PairEntries entries() const override;
    bool ofFeatures() const override { return true; }
    /// Ignores the setting, since features are denser than leaves. With a larger one searches are rarer and find
    /// more pairs; measured on the bunnies and the spline.
    double slack(double) const override { return 0.15; }
    float guard(const Pose& X_OT) const override;
    NearestPoints nearest(const Pose& X_OT, const PairEntry& pair) const;  ///< of a pair, in double
    /// Calls visit(PairEntry) for all entries of a coverage that the step of the tool between two poses may
    /// cross (CrossingSieve), until it returns false. Pre: the entries are complete for the coverage, whose motion is
    /// the step. inside: of the crossing.
    template <class Visit>
    void forEachCrossing(const PairEntries& entries, const Coverage& asked, const Pose& before, const Pose& after,
                         double least, Visit&& visit, double inside = 0) const {
        crossErased(
            entries, asked, before, after, least, inside,
            [](void* v, const PairEntry& e) { return (*static_cast<std::remove_reference_t<Visit>*>(v))(e); }, &visit);
    }
    /// Calls visit(PairEntry, gap) for all pairs of a coverage until it returns false. Returns false if the budget
    /// ended the search.
    template <class Visit>
    bool forEachPair(const Coverage& asked, Visit&& visit) {
        auto each = [&](PairKind kind, const int* ours, const int* others, simd::Mask near, const simd::Float8& gaps,
                        const Separation8&) {
            for (; near; near &= near - 1) {
                const int i = std::countr_zero(near);
                if (!visit(PairEntry{toolFeature(kind, ours[i]), others[i]}, gaps[i])) return false;
            }
            return true;
        };
        return walk(asked, Bounds::Close, each);
    }

  private:
    /// Up to eight pairs of one kind: features, those that are near, gaps and separations.
    using ErasedVisit = bool (*)(void*, PairKind, const int* ours, const int* others, simd::Mask near,
                                 const simd::Float8& gaps, const Separation8&);
    using ErasedCrossing = bool (*)(void*, const PairEntry&);
    /// How closely the gap of a pair is bounded along a motion. Close bounds keep fewer pairs and take more time.
    enum class Bounds : std::uint8_t { Quick, Close };
    struct Query;
    struct Swept;
    struct Swept8;
    struct Ends;
    struct Node {
        int height, index;
    };
    struct Nodes {
        int height;
        std::span<std::int32_t> all;
    };

    bool search(const Coverage& asked, PairEntries& out) override;
    void select(const PairEntries& from, const Coverage& asked, PairEntries& out, bool renew) override;
    /// Returns false if the budget ended the search.
    template <class Visit>
    bool walk(const Coverage& asked, Bounds bounds, Visit& visit) {
        return walkErased(
            asked, bounds, [](void* v, auto... eight) { return (*static_cast<Visit*>(v))(eight...); }, &visit);
    }
    bool walkErased(const Coverage& asked, Bounds bounds, ErasedVisit visit, void* context);
    void crossErased(const PairEntries& entries, const Coverage& asked, const Pose& before, const Pose& after,
                     double least, double inside, ErasedCrossing visit, void* context) const;
    template <class Visit>
    void forEachNear(const PairEntries& entries, const Coverage& asked, const Ends& ends, float apartFromFaces,
                     Visit&& visit) const;
    template <class Visit>
    bool descend(const Query& query, FeatureKind kind, FeatureKind other, Node a, const Swept& swept, Nodes others,
                 Visit& visit);
    template <class Visit>
    bool walkKinds(const Query& query, FeatureKind kind, FeatureKind other, Visit&& visit);

    const Surface* tool_;
    const Surface* obstacle_;
    double leastAbout_;  ///< smallest distance that bounds the travel of a turn, mm
    // Eights of the features of one patch of the tool during a search: their boxes, and of edges the directions and
    // wings.
    AlignedVector<Box8> placed_;
    AlignedVector<std::pair<Vec8, EdgeLanes>> placedEdges_;
    // The edges of one patch of the obstacle: boxes, directions and wings.
    struct Resting {
        Box8 box;
        Vec8 direction;
        EdgeLanes wings;
    };
    AlignedVector<Resting> resting_;
    AlignedVector<std::int32_t> nodes_;  ///< of the obstacle: those that a node of the tool and the ones above it meet
};

}  // namespace touchstone
