#pragma once
// A four-way tree of boxes, tested four at a time with SIMD. The builder's distance, winding-number and range queries
// traverse it.
#include <array>
#include <vector>

#include "haptics/math/rigid.hpp"

namespace touchstone {

struct Box {
    Vec3 lo = Vec3::Constant(HUGE_VAL);
    Vec3 hi = Vec3::Constant(-HUGE_VAL);

    void add(const Vec3& p) {
        lo = lo.cwiseMin(p);
        hi = hi.cwiseMax(p);
    }
    void add(const Box& b) {
        lo = lo.cwiseMin(b.lo);
        hi = hi.cwiseMax(b.hi);
    }
    Vec3 center() const { return 0.5 * (lo + hi); }
    double diagonal() const { return (hi - lo).norm(); }
};

/// A static tree over n boxes, built by median splits. Deterministic. nodes()[0] is the root; the tree of an empty set
/// has one node without children. Item k of a bucket is order()[first + k].
class BoxTree {
  public:
    static constexpr int kBucket = 4;   ///< maximum number of items in a bucket: one SIMD step
    static constexpr int kStack = 128;  ///< stack size of a depth-first walk: at most three waiting nodes per level

    struct Node {
        std::array<Eigen::Array4d, 3> lo, hi;
        std::array<int, 4> first{};  ///< first item of a bucket, or index of the child node
        std::array<int, 4> count{};  ///< size of a bucket; 0 for a child node; -1 for an empty slot

        /// Squared distances from p to the four boxes; infinite for empty slots.
        Eigen::Array4d squaredDistance(const Vec3& p) const {
            Eigen::Array4d sum = Eigen::Array4d::Zero();
            for (int a = 0; a < 3; ++a) sum += (lo[a] - p[a]).max(p[a] - hi[a]).max(0.0).square();
            return sum;
        }
    };

    explicit BoxTree(const std::vector<Box>& boxes);

    const std::vector<Node>& nodes() const { return nodes_; }
    const std::vector<int>& order() const { return order_; }

  private:
    int build(const std::vector<Vec3>& centers, const std::vector<Box>& boxes, int first, int last);

    std::vector<Node> nodes_;
    std::vector<int> order_;
};

}  // namespace touchstone
