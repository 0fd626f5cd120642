// The reduction of a time series to pixel columns, and the round numbers of its axes.
#include <catch2/catch.hpp>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "engine/view/plots.hpp"

namespace touchstone::plots_tests {

using namespace touchstone::engine;

namespace {

RingView whole(const std::vector<float>& values) { return {values.data(), values.size(), 0, values.size()}; }

}  // namespace

TEST_CASE("plots: a ring is read from its oldest sample", "[plots]") {
    const std::vector<float> data{30, 40, 0, 10, 20};  // index 2 is written next
    const RingView full{data.data(), 5, 2, 5};
    for (std::size_t i = 0; i < 5; ++i) REQUIRE(full[i] == static_cast<float>(10 * i));
    const RingView lastTwo{data.data(), 5, 2, 2};
    REQUIRE(lastTwo[0] == 30);
    REQUIRE(lastTwo[1] == 40);
}

TEST_CASE("plots: columns hold the range of their samples", "[plots]") {
    const std::vector<float> data{1, 5, 2, 2, -3, 0};
    REQUIRE(minMaxColumns(whole(data), {6}, 3) == std::vector<ColumnRange>{{1, 5}, {2, 2}, {-3, 0}});
}

TEST_CASE("plots: a short series is at the right, and the rest is empty", "[plots]") {
    const std::vector<float> data{7, 8};
    const auto columns = minMaxColumns(whole(data), {8}, 4);
    REQUIRE(columns[0].empty());
    REQUIRE(columns[1].empty());
    REQUIRE(columns[2].empty());
    REQUIRE(columns[3] == ColumnRange{7, 8});
}

TEST_CASE("plots: only the newest samples of a long series are shown", "[plots]") {
    const std::vector<float> data{100, 1, 2, 3, 4};
    REQUIRE(minMaxColumns(whole(data), {4}, 2) == std::vector<ColumnRange>{{1, 2}, {3, 4}});
}

TEST_CASE("plots: an interval may end before the newest sample", "[plots]") {
    const std::vector<float> data{1, 2, 3, 4, 5};
    REQUIRE(minMaxColumns(whole(data), {2, 1}, 2) == std::vector<ColumnRange>{{3, 3}, {4, 4}});
    const auto columns = minMaxColumns(whole(data), {4, 3}, 4);  // two samples remain
    REQUIRE(columns[1].empty());
    REQUIRE(columns[3] == ColumnRange{2, 2});
    const RingView turned{data.data(), 5, 2, 5};  // 3 4 5 1 2
    const auto pieces = samplesIn(turned, {3, 1});
    REQUIRE(std::vector<float>(pieces[0].begin(), pieces[0].end()) == std::vector<float>{4, 5});
    REQUIRE(std::vector<float>(pieces[1].begin(), pieces[1].end()) == std::vector<float>{1});
    REQUIRE(samplesIn(turned, {3, 5})[0].empty());
    REQUIRE(samplesIn(turned, {3, 9})[0].empty());
}

TEST_CASE("plots: a histogram counts every sample once, by decades", "[plots]") {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<float> data{0.001f, 0, 2, 3, 20, 30, 40, 999, 1e9f, nan};
    const auto counts = logHistogram(whole(data), {10, 0}, 1, 1000, 3);
    REQUIRE(counts == std::vector<std::size_t>{4, 3, 2});
    REQUIRE(logHistogram(whole(data), {2, 0}, 1, 1000, 3) == std::vector<std::size_t>{0, 0, 1});
}

TEST_CASE("plots: with fewer samples than columns each repeats", "[plots]") {
    const std::vector<float> data{1, 2};
    REQUIRE(minMaxColumns(whole(data), {2}, 4) == std::vector<ColumnRange>{{1, 1}, {1, 1}, {2, 2}, {2, 2}});
}

TEST_CASE("plots: NaN and infinity are not drawn, and no samples give empty columns", "[plots]") {
    const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    const std::vector<float> data{nan, 2, infinity, nan};
    const auto columns = minMaxColumns(whole(data), {4}, 2);
    REQUIRE(columns[0] == ColumnRange{2, 2});
    REQUIRE(columns[1].empty());
    REQUIRE(minMaxColumns(RingView{}, {0}, 3) == std::vector<ColumnRange>(3));
    REQUIRE(minMaxColumns(whole(data), {4}, 0).empty());
}

TEST_CASE("plots: a spike of one sample is always visible, and the newest sample is in the last column", "[plots]") {
    const std::uint32_t seed = 77;
    INFO("seed " << seed);
    std::mt19937 random(seed);
    for (int trial = 0; trial < 300; ++trial) {
        const std::size_t capacity = 1 + random() % 500, window = 1 + random() % 600, columnCount = 1 + random() % 300;
        const RingView ring{nullptr, capacity, random() % capacity, 1 + random() % capacity};
        std::vector<float> data(capacity, 0.f);
        RingView view = ring;
        view.data = data.data();
        const std::size_t shown = std::min(view.count, window);
        const std::size_t spike = view.count - 1 - random() % shown;  // from the oldest
        data[(view.next + capacity - view.count + spike) % capacity] = 9;
        data[(view.next + capacity - 1) % capacity] += 1;  // the newest

        const auto columns = minMaxColumns(view, {window}, columnCount);
        INFO("capacity " << capacity << " window " << window << " columns " << columnCount << " spike " << spike);
        float largest = 0;
        for (const ColumnRange& c : columns)
            if (!c.empty()) largest = std::max(largest, c.max);
        REQUIRE(largest >= 9);
        REQUIRE_FALSE(columns.back().empty());
        REQUIRE(columns.back().max >= 1);
    }
}

TEST_CASE("plots: axis ticks are round numbers inside the range", "[plots]") {
    REQUIRE(niceTicks(0, 10, 6) == std::vector<float>{0, 2, 4, 6, 8, 10});
    REQUIRE(niceTicks(0, 10, 5) == std::vector<float>{0, 5, 10});
    REQUIRE(niceTicks(-5000, 0, 3) == std::vector<float>{-4000, -2000, 0});
    const auto small = niceTicks(0.12f, 0.31f, 4);
    REQUIRE(small.size() == 4);
    REQUIRE(small[0] == Approx(0.15f));
    REQUIRE(small[3] == Approx(0.30f));
    REQUIRE(niceTicks(1, 1, 5).empty());
    REQUIRE(niceTicks(2, 1, 5).empty());
    REQUIRE(niceTicks(0, std::numeric_limits<float>::infinity(), 5).empty());
    REQUIRE(niceTicks(0, 1, 0).empty());
}

}  // namespace touchstone::plots_tests
