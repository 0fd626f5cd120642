#pragma once
// A tree of boxes and normal cones over features of one kind: eight children a node, tested at once.
#include <array>
#include <cmath>
#include <vector>

#include "haptics/collision/tree_walk.hpp"
#include "haptics/math/aligned.hpp"
#include "haptics/math/simd.hpp"

namespace touchstone {

/// A feature for the tree, mm: the corners of a vertex, an edge or a face (the last one may repeat), and the directions
/// in which it can be touched.
struct FeatureShape {
    std::array<Eigen::Vector3f, 3> corners;
    Eigen::Vector3f axis;  ///< of unit length: the outward normals at which the feature can touch lie around it ...
    float angle = 0;       ///< ... within this angle, rad; pi and more: any direction
};

/// A static tree over the features, built by median splits. Feature i of the tree is order[i] of the constructor's
/// list.
class FeatureTree {
  public:
    FeatureTree() = default;
    /// Sets `order` to the order of the features in the tree. `guard`: by which bounds are widened for rounding, mm.
    FeatureTree(const std::vector<FeatureShape>& features, float guard, std::vector<int>& order);

    int count() const { return count_; }
    /// Upper bound on the number of node pairs that wait during a walk of two trees.
    static int stackFor(const FeatureTree& a, const FeatureTree& b) { return 64 * (a.depth_ + b.depth_) + 64; }

    struct Bounds {
        Eigen::Vector3f lo, hi, axis;
        float angle;
    };
    struct Node {
        Bounds own;
        simd::Float8 lo[3], hi[3], axis[3], angle, cosine, sine;  ///< of the children
        std::int32_t first;                                       ///< first child: a node, or a feature if isLeaf
        std::int32_t count;                                       ///< children; missing ones have empty boxes
        bool isLeaf;
    };
    const AlignedVector<Node>& nodes() const { return nodes_; }

  private:
    struct Builder;

    AlignedVector<Node> nodes_;
    int count_ = 0, depth_ = 0;
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
                center += 0.5f * R(k, i) * (lo[i] + hi[i]);
                half += 0.5f * std::abs(R(k, i)) * (hi[i] - lo[i]);
            }
            outLo[k] = center - half;
            outHi[k] = center + half;
        }
    }
};

}  // namespace touchstone
