#include "haptics/surface/feature_tree.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace touchstone {
namespace {

using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;
/// Added to angles in float, rad: more than the rounding of their sums.
constexpr float kAngleGuard = 1e-5f;

}  // namespace

struct FeatureTree::Builder {
    FeatureTree& tree;
    const std::vector<FeatureShape>& features;
    std::vector<int>& order;
    float guard;
    std::vector<Vector3f> centers;

    Bounds boundsOf(std::span<const int> group) const;
    void build(int node, int first, int last, int depth);
};

FeatureTree::Bounds FeatureTree::Builder::boundsOf(std::span<const int> group) const {
    Bounds out;
    out.lo.setConstant(HUGE_VALF);
    out.hi.setConstant(-HUGE_VALF);
    Vector3f sum = Vector3f::Zero();
    for (const int i : group) {
        for (const Vector3f& p : features[i].corners) out.lo = out.lo.cwiseMin(p), out.hi = out.hi.cwiseMax(p);
        sum += features[i].axis;
    }
    out.axis = features[group[0]].axis;
    out.angle = features[group[0]].angle;
    if (group.size() > 1) {
        out.angle = kPi;
        if (sum.norm() > 1e-3f) {
            out.axis = sum.normalized();
            out.angle = 0;
            for (const int i : group) {
                const Vector3f& axis = features[i].axis;
                const float between = std::atan2(out.axis.cross(axis).norm(), out.axis.dot(axis));
                out.angle = std::max(out.angle, between + features[i].angle + kAngleGuard);
            }
        }
    }
    out.angle = std::min(out.angle, kPi);
    out.lo.array() -= guard;
    out.hi.array() += guard;
    return out;
}

void FeatureTree::Builder::build(int node, int first, int last, int depth) {
    tree.depth_ = std::max(tree.depth_, depth);
    const bool isLeaf = last - first <= 8;
    std::vector<int> cuts{first, last};
    if (isLeaf) {
        for (int i = first + 1; i < last; ++i) cuts.insert(cuts.end() - 1, i);
    } else {
        for (int split = 0; split < 3; ++split) {  // three median splits make eight parts
            std::vector<int> next{first};
            for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
                const auto begin = order.begin() + cuts[k], end = order.begin() + cuts[k + 1];
                if (end - begin > 1) {
                    Vector3f lo = centers[*begin], hi = lo;
                    for (auto i = begin; i != end; ++i) lo = lo.cwiseMin(centers[*i]), hi = hi.cwiseMax(centers[*i]);
                    int axis = 0;
                    (hi - lo).maxCoeff(&axis);
                    const auto middle = begin + (end - begin) / 2;
                    std::nth_element(begin, middle, end, [&](int i, int j) {
                        const float x = centers[i][axis], y = centers[j][axis];
                        return x != y ? x < y : i < j;
                    });
                    next.push_back(int(middle - order.begin()));
                }
                next.push_back(cuts[k + 1]);
            }
            cuts = std::move(next);
        }
    }
    const int parts = int(cuts.size()) - 1, firstChild = isLeaf ? first : int(tree.nodes_.size());
    if (!isLeaf) {
        tree.nodes_.resize(tree.nodes_.size() + std::size_t(parts));
        for (int k = 0; k < parts; ++k) build(firstChild + k, cuts[k], cuts[k + 1], depth + 1);
    }
    const auto group = [&](int from, int to) { return std::span<const int>(order).subspan(from, to - from); };
    Node& made = tree.nodes_[std::size_t(node)];
    made.own = boundsOf(group(first, last));
    made.first = firstChild;
    made.count = parts;
    made.isLeaf = isLeaf;
    for (int k = 0; k < 8; ++k) {
        Bounds child{Vector3f::Constant(1e30f), Vector3f::Constant(-1e30f), Vector3f::Zero(), 0};
        if (k < parts)
            child = isLeaf ? boundsOf(group(cuts[k], cuts[k + 1])) : tree.nodes_[std::size_t(firstChild + k)].own;
        for (int a = 0; a < 3; ++a)
            made.lo[a][k] = child.lo[a], made.hi[a][k] = child.hi[a], made.axis[a][k] = child.axis[a];
        made.angle[k] = child.angle;
        made.cosine[k] = std::cos(child.angle);
        made.sine[k] = std::sin(child.angle);
    }
}

FeatureTree::FeatureTree(const std::vector<FeatureShape>& features, float guard, std::vector<int>& order)
    : count_(int(features.size())) {
    order.resize(features.size());
    Builder builder{*this, features, order, guard, {}};
    for (int i = 0; i < count_; ++i) {
        order[std::size_t(i)] = i;
        const auto& c = features[std::size_t(i)].corners;
        builder.centers.push_back(c[0].cwiseMin(c[1]).cwiseMin(c[2]) + c[0].cwiseMax(c[1]).cwiseMax(c[2]));
    }
    if (count_ == 0) return;
    nodes_.emplace_back();
    builder.build(0, 0, count_, 1);
}

}  // namespace touchstone
