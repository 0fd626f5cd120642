#pragma once
// The Pareto front of speed against error, for the plots of the benchmark and of the window.
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace touchstone::sandbox {

using TimeAndError = std::pair<double, double>;  ///< µs, N

/// Smaller errors are drawn here on logarithmic axes, N: the only error of an exact answer is rounding.
inline constexpr double kLeastError = 1e-9;

/// Indices of the points that no other point dominates: none is at least as fast with a smaller error, or faster with
/// the same error. Ordered by increasing time, therefore by decreasing error; of equal points the first.
std::vector<std::size_t> paretoFront(std::span<const TimeAndError> points);

}  // namespace touchstone::sandbox
