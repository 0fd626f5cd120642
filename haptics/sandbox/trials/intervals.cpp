#include "haptics/sandbox/trials/intervals.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <random>

namespace touchstone::sandbox {
namespace {

constexpr double kZ = 1.959963984540054;  // 97.5 % quantile of the normal distribution
constexpr int kResamples = 2000;

}  // namespace

Interval wilson(int successes, int trials) {
    assert(trials > 0 && successes >= 0 && successes <= trials);
    const double n = trials, p = successes / n, z2 = kZ * kZ;
    const double center = (p + z2 / (2 * n)) / (1 + z2 / n);
    const double half = kZ / (1 + z2 / n) * std::sqrt(p * (1 - p) / n + z2 / (4 * n * n));
    return {std::max(0.0, center - half), std::min(1.0, center + half)};
}

double meanOf(std::span<const double> values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double medianOf(std::vector<double> values) {
    const std::size_t half = values.size() / 2;
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(half), values.end());
    if (values.size() % 2) return values[half];
    return (values[half] + *std::max_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(half))) / 2;
}

Interval bootstrap(std::span<const double> values, double (*statistic)(std::vector<double>)) {
    assert(values.size() >= 2);
    std::mt19937_64 random(1);
    std::vector<double> drawn(values.size()), found(kResamples);
    for (double& one : found) {
        for (double& value : drawn) value = values[random() % values.size()];
        one = statistic(drawn);
    }
    std::sort(found.begin(), found.end());
    return {found[kResamples / 40 - 1], found[kResamples - kResamples / 40]};
}

}  // namespace touchstone::sandbox
