#include "haptics/surface/feature_tree.hpp"

#include <algorithm>
#include <numbers>
#include <numeric>

namespace touchstone {
namespace {

using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;

/// Splits at multiples of the largest power of eight below the count, so that all nodes but the last ones are full.
void split(std::span<int> order, std::span<const Vector3f> centers) {
    const int count = int(order.size());
    int whole = FeatureTree::kChildren;
    if (count <= whole) return;
    while (whole * FeatureTree::kChildren < count) whole *= FeatureTree::kChildren;
    Vector3f lo = centers[order[0]], hi = lo;
    for (const int i : order) lo = lo.cwiseMin(centers[i]), hi = hi.cwiseMax(centers[i]);
    int axis = 0;
    (hi - lo).maxCoeff(&axis);
    const int middle = ((count + whole - 1) / whole / 2) * whole;
    std::nth_element(order.begin(), order.begin() + middle, order.end(), [&](int i, int j) {
        const float x = centers[i][axis], y = centers[j][axis];
        return x != y ? x < y : i < j;
    });
    split(order.first(middle), centers);
    split(order.subspan(middle), centers);
}

}  // namespace

std::vector<int> FeatureTree::order(std::span<const Vector3f> centers) {
    std::vector<int> order(centers.size());
    std::iota(order.begin(), order.end(), 0);
    split(order, centers);
    return order;
}

FeatureBounds FeatureBounds::of(std::span<const FeatureBounds> parts) {
    FeatureBounds all;
    Vector3f sum = Vector3f::Zero();
    const FeatureBounds* only = nullptr;
    int count = 0;
    for (const FeatureBounds& part : parts) {
        if (part.empty()) continue;
        all.add(part.lo);
        all.add(part.hi);
        sum += part.normals.axis;
        only = &part;
        ++count;
    }
    if (count == 1) return *only;
    NormalCone& cone = all.normals;
    if (sum.norm() > 1e-3f) {
        cone.axis = sum.normalized();
        for (const FeatureBounds& part : parts) {
            if (part.empty()) continue;
            const Vector3f& axis = part.normals.axis;
            const float between = std::atan2(cone.axis.cross(axis).norm(), cone.axis.dot(axis));
            cone.angle = std::max(cone.angle, between + part.normals.angle + kAngleGuard);
        }
    } else {
        cone.angle = kPi;
    }
    cone.angle = std::min(cone.angle, kPi);
    return all;
}

FeatureBounds FeatureTree::Bounds8::lane(int i) const {
    return {{lo[0][i], lo[1][i], lo[2][i]},
            {hi[0][i], hi[1][i], hi[2][i]},
            {{axis[0][i], axis[1][i], axis[2][i]}, angle[i]}};
}

void FeatureTree::Bounds8::set(int i, const FeatureBounds& bounds) {
    for (int k = 0; k < 3; ++k) {
        lo[k][i] = bounds.lo[k];
        hi[k][i] = bounds.hi[k];
        axis[k][i] = bounds.normals.axis[k];
    }
    angle[i] = bounds.normals.angle;
    cosine[i] = std::cos(bounds.normals.angle);
    sine[i] = std::sin(bounds.normals.angle);
}

FeatureTree::FeatureTree(std::span<const std::array<FeatureBounds, kFeatureKinds>> patches) {
    std::vector<std::array<FeatureBounds, kFeatureKinds>> nodes(patches.begin(), patches.end());
    while (!nodes.empty()) {
        const int count = int(nodes.size());
        AlignedVector<Block>& level = levels_.emplace_back(std::size_t((count + kChildren - 1) / kChildren));
        std::vector<std::array<FeatureBounds, kFeatureKinds>> parents(count > 1 ? level.size() : 0);
        for (std::size_t block = 0; block < level.size(); ++block)
            for (std::size_t kind = 0; kind < kFeatureKinds; ++kind) {
                std::array<FeatureBounds, kChildren> children;
                for (int i = 0; i < kChildren; ++i) {
                    const int node = int(block) * kChildren + i;
                    if (node < count) children[std::size_t(i)] = nodes[std::size_t(node)][kind];
                    level[block][kind].set(i, children[std::size_t(i)]);
                }
                if (count > 1) parents[block][kind] = FeatureBounds::of(children);
            }
        counts_.push_back(count);
        nodes = std::move(parents);
    }
}

std::size_t FeatureTree::bytes() const {
    std::size_t sum = 0;
    for (const AlignedVector<Block>& level : levels_) sum += level.capacity() * sizeof(Block);
    return sum;
}

}  // namespace touchstone
