#include "haptics/math/statistics.hpp"

#include <random>

namespace touchstone {
namespace {

constexpr double kZ = 1.959963984540054;  // 97.5 % quantile of the standard normal distribution
constexpr int kResamples = 2000;

}  // namespace

double median(std::vector<double> values) {
    const std::size_t half = values.size() / 2;
    const double upper = upperMedian(values);
    if (values.size() % 2) return upper;
    return (upper + *std::max_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(half))) / 2;
}

Percentiles percentiles(std::vector<double> values) {
    return {percentile(values, 50), percentile(values, 99), percentile(values, 99.9), percentile(values, 100)};
}

Interval wilsonInterval(int successes, int trials) {
    assert(trials > 0 && successes >= 0 && successes <= trials);
    const double n = trials, p = successes / n, z2 = kZ * kZ;
    const double center = (p + z2 / (2 * n)) / (1 + z2 / n);
    const double half = kZ / (1 + z2 / n) * std::sqrt(p * (1 - p) / n + z2 / (4 * n * n));
    return {std::max(0.0, center - half), std::min(1.0, center + half)};
}

Interval bootstrapInterval(std::span<const double> values, double (*statistic)(std::vector<double>)) {
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

}  // namespace touchstone
