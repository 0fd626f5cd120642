#pragma once
// Confidence intervals of means, medians and success rates.
#include <cstdint>
#include <span>
#include <vector>

namespace touchstone::sandbox {

struct Interval {
    double low = 0, high = 0;
};

/// 95 % confidence interval of a rate of `successes` in `trials`, by Wilson's score. Pre: 0 <= successes <= trials > 0.
/// Source: Wilson (1927), Probable inference, the law of succession, and statistical inference.
Interval wilson(int successes, int trials);

double meanOf(std::span<const double> values);
double medianOf(std::vector<double> values);  ///< for an even count, the mean of the two middle values

/// 95 % confidence interval of a statistic by percentile bootstrap: 2,000 resamples from a fixed random seed. O(n)
/// each. Pre: at least two values. Source: Efron (1979), Bootstrap methods: another look at the jackknife.
Interval bootstrap(std::span<const double> values, double (*statistic)(std::vector<double>));

}  // namespace touchstone::sandbox
