#include "haptics/builder/box_tree.hpp"

#include <algorithm>
#include <numeric>

namespace touchstone {

BoxTree::BoxTree(const std::vector<Box>& boxes) : order_(boxes.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    std::vector<Vec3> centers;
    centers.reserve(boxes.size());
    for (const Box& b : boxes) centers.push_back(b.center());
    nodes_.reserve(boxes.size() / 4 + 1);
    build(centers, boxes, 0, static_cast<int>(boxes.size()));
}

int BoxTree::build(const std::vector<Vec3>& centers, const std::vector<Box>& boxes, int first, int last) {
    // Splits a range at its median along its longest axis. Ties are broken by index, so that the order is the same on
    // every platform.
    const auto split = [&](int from, int to) {
        if (to - from <= kBucket) return to;
        Box extent;
        for (int i = from; i < to; ++i) extent.add(centers[order_[i]]);
        int axis = 0;
        (extent.hi - extent.lo).maxCoeff(&axis);
        const int middle = from + (to - from + 1) / 2;
        std::nth_element(order_.begin() + from, order_.begin() + middle, order_.begin() + to, [&](int a, int b) {
            return centers[a][axis] < centers[b][axis] || (centers[a][axis] == centers[b][axis] && a < b);
        });
        return middle;
    };
    const int middle = split(first, last);
    const std::array<int, 5> cut{first, split(first, middle), middle, split(middle, last), last};

    const int self = static_cast<int>(nodes_.size());
    nodes_.emplace_back();
    for (int k = 0; k < 4; ++k) {
        Box extent;
        for (int i = cut[k]; i < cut[k + 1]; ++i) extent.add(boxes[order_[i]]);
        for (int a = 0; a < 3; ++a) {
            nodes_[self].lo[a][k] = extent.lo[a];
            nodes_[self].hi[a][k] = extent.hi[a];
        }
        const int count = cut[k + 1] - cut[k];
        const int child = count > kBucket ? build(centers, boxes, cut[k], cut[k + 1]) : cut[k];
        nodes_[self].first[k] = child;
        nodes_[self].count[k] = count > kBucket ? 0 : count == 0 ? -1 : count;
    }
    return self;
}

}  // namespace touchstone
