#include "haptics/math/statistics.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <numeric>
#include <random>

namespace touchstone::statistics_tests {

TEST_CASE("medians: of an even count the median averages the middle two, the 50th percentile is the lower of them",
          "[statistics]") {
    std::vector<double> even{4, 1, 3, 2}, odd{9, 1, 5};
    CHECK(median(even) == 2.5);
    CHECK(*percentile(even, 50) == 2);
    CHECK(upperMedian(even) == 3);
    CHECK(median(odd) == 5);
    CHECK(*percentile(odd, 50) == 5);
    CHECK(upperMedian(odd) == 5);
}

TEST_CASE("percentile: nearest rank, on lists with known answers", "[statistics]") {
    std::vector<double> none;
    CHECK_FALSE(percentile(none, 50));
    std::vector<double> one{7};
    CHECK(percentile(one, 0.1) == 7.0);
    CHECK(percentile(one, 100) == 7.0);
    std::vector<double> five{50, 15, 40, 20, 35};
    CHECK(percentile(five, 30) == 20.0);  // rank ceil(1.5) = 2 of 15 20 35 40 50
    CHECK(percentile(five, 40) == 20.0);  // rank 2 exactly
    CHECK(percentile(five, 50) == 35.0);
    CHECK(percentile(five, 100) == 50.0);
    std::vector<double> thousand(1000);
    std::iota(thousand.begin(), thousand.end(), 1.0);
    CHECK(percentile(thousand, 99) == 990.0);
    CHECK(percentile(thousand, 99.9) == 999.0);  // not 1000, which rounding of 99.9 would give
    CHECK(percentile(thousand, 100) == 1000.0);
}

TEST_CASE("percentile: the smallest value that at least this share of the values does not exceed", "[statistics]") {
    const unsigned seed = 3;
    INFO("seed " << seed);
    std::mt19937 random(seed);
    for (int round = 0; round < 100; ++round) {
        std::vector<double> values(1 + random() % 300);
        for (double& value : values) value = static_cast<double>(random() % 50);  // with ties
        for (const double percent : {1.0, 50.0, 99.0, 99.9, 100.0}) {
            const double found = *percentile(values, percent);
            const auto share = [&](auto below) {
                return 100.0 * static_cast<double>(std::count_if(values.begin(), values.end(), below)) /
                       static_cast<double>(values.size());
            };
            CHECK(share([&](double v) { return v <= found; }) >= percent - 1e-6);
            CHECK(share([&](double v) { return v < found; }) < percent);
        }
    }
}

TEST_CASE("confidence intervals: Wilson intervals equal published tables", "[statistics]") {
    // Newcombe (1998), Two-sided confidence intervals for the single proportion, table I, method 3.
    const auto check = [](int successes, int trials, double low, double high) {
        const Interval interval = wilsonInterval(successes, trials);
        CHECK(interval.low == Approx(low).margin(5e-5));
        CHECK(interval.high == Approx(high).margin(5e-5));
    };
    check(81, 263, 0.2553, 0.3662);
    check(15, 148, 0.0624, 0.1605);
    check(0, 20, 0, 0.1611);
    check(1, 29, 0.0061, 0.1718);
}

TEST_CASE("confidence intervals: bootstrap intervals have the theoretical width", "[statistics]") {
    std::vector<double> values;
    for (int i = 0; i < 400; ++i) values.push_back(i);
    const auto meanOf = [](std::vector<double> v) { return mean(v); };
    const Interval interval = bootstrapInterval(values, meanOf);
    // Numbers 0 to 399: standard deviation 115.5, so 1.96 x 115.5 / 20 = 11.3 to each side; 2,000 resamples estimate
    // this to about 5 %.
    CHECK(interval.low == Approx(199.5 - 11.3).margin(1));
    CHECK(interval.high == Approx(199.5 + 11.3).margin(1));
    const Interval again = bootstrapInterval(values, meanOf);
    CHECK(again.low == interval.low);
    const Interval same = bootstrapInterval(std::vector<double>(5, 3.0), median);
    CHECK(same.low == 3);
    CHECK(same.high == 3);
}

}  // namespace touchstone::statistics_tests
