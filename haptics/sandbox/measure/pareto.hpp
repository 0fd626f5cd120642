#pragma once
// Speed against error: what the benchmark's plots and the window's share.
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace touchstone::sandbox {

using TimeAndError = std::pair<double, double>;  ///< µs, N

/// What is less is drawn here on logarithmic axes, N: an exact answer has no error but rounding.
inline constexpr double kLeastError = 1e-9;

/// Indices of the points that no other beats: nothing else is both at least as fast and less wrong, or faster and as
/// wrong. By rising time, so by falling error; of equal points the first.
std::vector<std::size_t> paretoFront(std::span<const TimeAndError> points);

}  // namespace touchstone::sandbox
