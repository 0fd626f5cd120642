#pragma once
// Finds which boxes of a set intersect a given box.
#include "haptics/builder/box_tree.hpp"

namespace touchstone {

/// The items, rearranged into a tree's order.
template <class T>
std::vector<T> inOrder(const std::vector<int>& order, const std::vector<T>& items) {
    std::vector<T> out;
    out.reserve(order.size());
    for (const int i : order) out.push_back(items[i]);
    return out;
}

/// Calls visit(i) for each box that intersects the given one until visit returns true. Returns whether it did. `boxes`
/// are in the tree's order, and i is an index in that order.
template <class Visit>
bool anyMeeting(const BoxTree& tree, const std::vector<Box>& boxes, const Box& box, Visit&& visit) {
    std::array<int, BoxTree::kStack> stack;
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const BoxTree::Node& node = tree.nodes()[stack[--top]];
        const Eigen::Array<bool, 4, 1> meets = node.lo[0] <= box.hi[0] && node.lo[1] <= box.hi[1] &&
                                               node.lo[2] <= box.hi[2] && node.hi[0] >= box.lo[0] &&
                                               node.hi[1] >= box.lo[1] && node.hi[2] >= box.lo[2];
        for (int k = 0; k < 4; ++k) {
            if (!meets[k] || node.count[k] < 0) continue;
            if (node.count[k] == 0) stack[top++] = node.first[k];
            for (int i = node.first[k]; i < node.first[k] + node.count[k]; ++i) {
                const bool itemMeets =
                    (boxes[i].lo.array() <= box.hi.array()).all() && (boxes[i].hi.array() >= box.lo.array()).all();
                if (itemMeets && visit(i)) return true;
            }
        }
    }
    return false;
}

}  // namespace touchstone
