#pragma once
// A tree of boxes and normal cones over the features of a part: eight children a node, tested at once.
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "haptics/collision/tree_walk.hpp"
#include "haptics/math/aligned.hpp"
#include "haptics/math/simd.hpp"

namespace touchstone {

/// Added to angles in float, rad: more than the rounding of their sums.
inline constexpr float kAngleGuard = 1e-5f;

/// Directions within `angle` (rad) of an axis of unit length; pi and more: any direction.
struct NormalCone {
    Eigen::Vector3f axis = Eigen::Vector3f::UnitX();
    float angle = 0;
};

/// A box that holds some features, mm, and a cone that holds the outward normals at which they can touch.
struct FeatureBounds {
    Eigen::Vector3f lo = Eigen::Vector3f::Constant(1e30f), hi = -lo;
    NormalCone normals;

    bool empty() const { return lo[0] > hi[0]; }
    void add(const Eigen::Vector3f& point) { lo = lo.cwiseMin(point), hi = hi.cwiseMax(point); }
    /// The bounds of all of these, of which some may be empty.
    static FeatureBounds of(std::span<const FeatureBounds> parts);
};

enum class FeatureKind { Vertex, Edge, Face };
inline constexpr std::size_t kFeatureKinds = 3;

/// Nodes of height 0 are patches: eight faces, with the edges and vertices that they own. Node i of height h + 1 has
/// the nodes 8i to 8i + 7 of height h as children; all of them exist but for the last ones. Each kind of feature has
/// bounds of its own, since edges are thinner than the faces beside them, and few vertices can touch.
class FeatureTree {
  public:
    static constexpr int kChildren = 8;
    struct Bounds8 {
        simd::Float8 lo[3], hi[3], axis[3], angle, cosine, sine;

        FeatureBounds lane(int i) const;
        void set(int i, const FeatureBounds& bounds);
    };
    /// The bounds of eight nodes, by kind of feature. Lanes without a feature have empty boxes.
    using Block = std::array<Bounds8, kFeatureKinds>;

    FeatureTree() = default;
    /// From the bounds of the patches, in their order.
    explicit FeatureTree(std::span<const std::array<FeatureBounds, kFeatureKinds>> patches);
    /// An order of faces with these centers for which patches and nodes are compact: by median splits.
    static std::vector<int> order(std::span<const Eigen::Vector3f> centers);

    bool empty() const { return counts_.empty(); }
    std::size_t bytes() const;                              ///< of memory
    int height() const { return int(counts_.size()) - 1; }  ///< of the root
    int count(int height) const { return counts_[std::size_t(height)]; }
    /// The bounds of nodes 8i to 8i + 7 of a height.
    const Bounds8& eight(FeatureKind kind, int height, int i) const {
        return levels_[std::size_t(height)][std::size_t(i)][std::size_t(kind)];
    }
    const Bounds8& children(FeatureKind kind, int height, int node) const { return eight(kind, height - 1, node); }
    int childCount(int height, int node) const { return std::min(kChildren, count(height - 1) - kChildren * node); }
    FeatureBounds bounds(FeatureKind kind, int height, int node) const {
        return eight(kind, height, node / kChildren).lane(node % kChildren);
    }

  private:
    std::vector<AlignedVector<Block>> levels_;  ///< by height
    std::vector<int> counts_;                   ///< nodes by height; the last one is 1
};

/// Boxes of a tool's tree as boxes on the obstacle's axes, from its center.
struct BoxPlacement {
    Eigen::Matrix3f R;
    Eigen::Vector3f t;  ///< the tool's center
    float guard;        ///< by which boxes are widened for rounding, mm

    /// Bounds of one box, or of eight. T: float or Float8.
    template <class T>
    TOUCHSTONE_INLINE void place(const T lo[3], const T hi[3], T outLo[3], T outHi[3]) const {
        for (int k = 0; k < 3; ++k) {
            T center = lo[0] * 0.0f + t[k], half = lo[0] * 0.0f + guard;
            for (int i = 0; i < 3; ++i) {
                center = simd::fma(0.5f * R(k, i), lo[i] + hi[i], center);
                half = simd::fma(0.5f * std::abs(R(k, i)), hi[i] - lo[i], half);
            }
            outLo[k] = center - half;
            outHi[k] = center + half;
        }
    }
};

}  // namespace touchstone
