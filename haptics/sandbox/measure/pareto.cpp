#include "haptics/sandbox/measure/pareto.hpp"

#include <algorithm>
#include <numeric>

namespace touchstone::sandbox {

std::vector<std::size_t> paretoFront(std::span<const TimeAndError> points) {
    std::vector<std::size_t> order(points.size()), front;
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return points[a] < points[b]; });
    for (const std::size_t i : order)
        if (front.empty() || points[i].second < points[front.back()].second) front.push_back(i);
    return front;
}

}  // namespace touchstone::sandbox
