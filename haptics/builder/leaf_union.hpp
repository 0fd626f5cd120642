#pragma once
// The leaves of a tree as one body: point tests, distances and samples of its outside. The tree check uses it.
#include <algorithm>
#include <cstdint>
#include <functional>
#include <vector>

#include "haptics/builder/box_tree.hpp"

namespace touchstone {

struct Leaf {
    Vec3 center = Vec3::Zero();
    double radius = 0;
};

/// A patch of a leaf's sphere that lies in no other leaf.
struct OutsidePatch {
    Vec3 point, normal;  ///< middle of the patch; unit normal, pointing out of the leaf
    double area;
};

/// The union of leaves. A leaf of negative radius is empty. Lengths are in the caller's units.
class LeafUnion {
  public:
    explicit LeafUnion(std::vector<Leaf> leaves);

    const std::vector<Leaf>& leaves() const { return leaves_; }
    /// Whether some leaf contains p.
    bool contains(const Vec3& p) const;
    /// Distance from p to the union; 0 inside.
    double gap(const Vec3& p) const;
    /// Calls visit(index) for the leaves within `reach` of p.
    template <class Visit>
    void near(const Vec3& p, double reach, Visit&& visit) const;

    /// Number of ordered pairs of overlapping leaves, so that each pair counts twice. Counting ends soon after
    /// `atMost`.
    std::int64_t overlaps(std::int64_t atMost) const;

    /// Cuts the boundary of the union into patches of at most `area`, and of at most an eighth of a leaf. A patch that
    /// the boundary of another leaf crosses belongs to the boundary if its middle does. Only every `stride`-th leaf is
    /// cut. `beat` receives the progress, 0 to 1. Throws std::invalid_argument if the work is out of proportion because
    /// many leaves nearly coincide.
    std::vector<OutsidePatch> outside(double area, std::uint64_t seed, int stride,
                                      const std::function<void(double)>& beat) const;
    /// Cuts the boundary into about `count` patches.
    std::vector<OutsidePatch> outside(int count, std::uint64_t seed, const std::function<void(double)>& beat) const;

  private:
    std::vector<Leaf> leaves_;
    BoxTree tree_;
    /// Centers and squared radii in the tree's order, with four more entries at the end for the SIMD steps. The squared
    /// radius is negative for empty leaves.
    std::array<std::vector<double>, 3> at_;
    std::vector<double> radius2_;
};

/// Calls visit(item) for the items of boxes that are nearer to p than sqrt(bound2). The walk is depth-first and takes
/// the nearest box first in each node. visit may lower bound2.
template <class Visit>
void visitNearest(const BoxTree& tree, const Vec3& p, double& bound2, Visit&& visit) {
    struct Waiting {
        double distance2;
        int node;
    };
    std::array<Waiting, BoxTree::kStack> stack;
    int top = 0;
    stack[top++] = {0, 0};
    while (top > 0) {
        const Waiting w = stack[--top];
        if (w.distance2 > bound2) continue;
        const BoxTree::Node& node = tree.nodes()[w.node];
        const Eigen::Array4d d2 = node.squaredDistance(p);
        std::array<int, 4> rank{0, 1, 2, 3};
        std::sort(rank.begin(), rank.end(), [&](int a, int b) { return d2[a] < d2[b]; });
        for (const int k : rank)
            for (int i = 0; i < node.count[k] && d2[k] <= bound2; ++i) visit(tree.order()[node.first[k] + i]);
        for (int r = 3; r >= 0; --r)
            if (const int k = rank[r]; node.count[k] == 0 && d2[k] <= bound2) stack[top++] = {d2[k], node.first[k]};
    }
}

template <class Visit>
void LeafUnion::near(const Vec3& p, double reach, Visit&& visit) const {
    double bound2 = reach * reach;
    visitNearest(tree_, p, bound2, [&](int i) {
        const double r = leaves_[i].radius + reach;
        if (leaves_[i].radius >= 0 && (leaves_[i].center - p).squaredNorm() <= r * r) visit(i);
    });
}

}  // namespace touchstone
