#pragma once
// The leaves of a tree as one body: what lies in it, how far off a point is, and samples of its outside. For checking.
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

/// A patch of some leaf's sphere that lies in no other leaf.
struct OutsidePatch {
    Vec3 point, normal;  ///< its middle; unit, out of the leaf
    double area;
};

/// The union of leaves. One of negative radius holds nothing. Lengths as the caller's.
class LeafUnion {
  public:
    explicit LeafUnion(std::vector<Leaf> leaves);

    const std::vector<Leaf>& leaves() const { return leaves_; }
    /// Some leaf holds p.
    bool contains(const Vec3& p) const;
    /// Distance of p from the union, 0 inside.
    double gap(const Vec3& p) const;
    /// Calls visit(index) for the leaves within `reach` of p.
    template <class Visit>
    void near(const Vec3& p, double reach, Visit&& visit) const;

    /// Pairs of leaves that overlap, each counted from both sides. Counting ends soon after `atMost`.
    std::int64_t overlaps(std::int64_t atMost) const;

    /// Cuts the union's boundary into patches of at most `area`, or an eighth of a leaf. A patch that the boundary of
    /// another leaf crosses counts by its middle. Every `stride`-th leaf only. `beat` is called now and then. Throws
    /// std::invalid_argument where the work is out of proportion, because many leaves nearly coincide.
    std::vector<OutsidePatch> outside(double area, std::uint64_t seed, int stride,
                                      const std::function<void(double)>& beat) const;
    /// The same in about `count` patches.
    std::vector<OutsidePatch> outside(int count, std::uint64_t seed, const std::function<void(double)>& beat) const;

  private:
    std::vector<Leaf> leaves_;
    BoxTree tree_;
    /// Centres and squared radii in the tree's order, four more at the end; negative for leaves that hold nothing.
    std::array<std::vector<double>, 3> at_;
    std::vector<double> radius2_;
};

/// Calls visit(item) for the items of boxes nearer to p than sqrt(bound2), nearest boxes first as far as a depth-first
/// walk can; visit may lower bound2.
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
