#pragma once
// How sure a mean, a median or a rate of success is.
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
double medianOf(std::vector<double> values);  ///< of an even count the mean of the middle two

/// 95 % confidence interval of a statistic by percentile bootstrap: 2,000 resamples, always the same ones. O(n) each.
/// Pre: at least two values. Source: Efron (1979), Bootstrap methods: another look at the jackknife.
Interval bootstrap(std::span<const double> values, double (*statistic)(std::vector<double>));

}  // namespace touchstone::sandbox
