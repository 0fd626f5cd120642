#pragma once
// Every mean, median, percentile and confidence interval that the program reports is defined here.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

namespace touchstone {

/// Arithmetic mean, summed in order in double precision. Pre: at least one value.
template <class Values>
double mean(const Values& values) {
    assert(!values.empty());
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Nearest-rank percentile: the smallest of the values that at least `percent` % of them do not exceed; nothing without
/// values. It is always one of the values, so it suits the tails of measured times, where interpolation would invent
/// ticks that never ran; percentile(values, 50) is the lower of the middle two of an even count. O(n), reorders
/// `values`. Pre: 0 < percent <= 100; no NaN.
template <class Values>
std::optional<typename Values::value_type> percentile(Values& values, double percent) {
    assert(percent > 0 && percent <= 100);
    if (values.empty()) return {};
    // 99.9 % of 1000 must be 999, not 1000 by rounding.
    const double exact = percent * static_cast<double>(values.size()) / 100;
    const auto rank = static_cast<std::size_t>(std::ceil(exact - 1e-9 * exact));
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::clamp<std::size_t>(rank, 1, values.size()) - 1);
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

/// The upper of the middle two of an even count, so that the median of thicknesses is one that occurs and is not
/// underestimated. O(n), reorders `values`. Pre: at least one value.
template <class Values>
typename Values::value_type upperMedian(Values& values) {
    assert(!values.empty());
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// The textbook median: of an even count the mean of the middle two. Studies report it, since their confidence
/// intervals assume it; with a few dozen trials the nearest rank would be biased downwards. O(n). Pre: at least one
/// value.
double median(std::vector<double> values);

/// Nearest-rank percentiles of one list; nothing without values.
struct Percentiles {
    std::optional<double> p50, p99, p999, max;
};
Percentiles percentiles(std::vector<double> values);

struct Interval {
    double low = 0, high = 0;
};

/// 95 % confidence interval of a success rate by Wilson's score. Pre: 0 <= successes <= trials, trials > 0.
/// Source: Wilson (1927), Probable inference, the law of succession, and statistical inference.
Interval wilsonInterval(int successes, int trials);

/// 95 % confidence interval of a statistic by percentile bootstrap: 2,000 resamples, drawn with a fixed random seed.
/// O(n) for each. Pre: at least two values. Source: Efron (1979), Bootstrap methods: another look at the jackknife.
Interval bootstrapInterval(std::span<const double> values, double (*statistic)(std::vector<double>));

}  // namespace touchstone
