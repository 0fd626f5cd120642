#pragma once
// The contacts of two meshes: pairs of features, of which each that a step would bring too near is a row.
#include <vector>

#include "haptics/collision/contact_list.hpp"
#include "haptics/surface/feature_crossing.hpp"
#include "haptics/surface/feature_pair_finder.hpp"

namespace touchstone {

/// No pair has a row because it is near: a row says that a step must not cross. The step moves every feature along a
/// straight path, so features that are apart before it and cross nothing on it are apart after it.
class FeatureList final : public ContactList {
  public:
    FeatureList(const Surface& tool, const Surface& obstacle, int obstacleIndex);

    Coverage coverageOf(const StraightMotion& step, double margin) const override;
    bool appendRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows, int maxRows) const override;
    int appendNearestRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows) const override;
    Crossed appendCrossed(const Pose& X_OT, const Pose& before, const Mat3& R_WO, double margin, const Crossing& by,
                          RowSet& rows, RowSet& crossed) override;
    Overlap remeasure(const Pose& before, const Pose& after, double tolerance) override;
    Nearest nearest(const Pose& X_OT, int toolFeature, int obstacleFeature) const override;
    double freeShare(const StraightMotion& motion, double atMost) override;
    bool hasFeatures(std::uint64_t pair) const override;
    Stand stand(const Pose& X_OT, std::uint64_t pair) const override;
    bool hasTwin(const Pose& X_OT, std::uint64_t pair, const Stand& like, double within) const override;
    bool ofFeatures() const override { return true; }
    /// Whether a move brings this pair too near, or nearer if it begins so, whatever the list holds.
    bool deepens(const PairEntry& pair, const Pose& before, const Pose& after) const;

  private:
    struct Found {
        std::uint64_t id;
        double after;
        CrossingRow row;
    };
    struct Step;
    struct Trial;

    FeaturePairFinder& pairs() const;
    double lean() const;
    std::optional<FeatureCrossing> crossingOf(const PairEntry& entry, const Step& step) const;
    bool test(const PairEntry& entry, const Trial& trial);
    bool deepens(const PairEntry& entry, const Step& step) const;
    Crossed appendFound(const Mat3& R_WO, const Crossing& by, double least, RowSet& rows, RowSet& crossed);

    const Surface* tool_;
    const Surface* obstacle_;
    int obstacleIndex_;
    std::vector<Found> found_;  ///< what a trial step crosses
};

}  // namespace touchstone
