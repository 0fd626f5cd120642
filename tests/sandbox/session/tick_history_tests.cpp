// The ticks behind the plots: which are kept, statistics of an interval, and the exported table.
#include "haptics/sandbox/session/tick_history.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>

#include "haptics/math/statistics.hpp"
#include "haptics/sandbox/record/tick_fields.hpp"
#include "tests/support/scene_maker.hpp"

namespace touchstone::tick_history_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;

namespace {

TickRecord tickOf(std::uint64_t number, double us, std::uint64_t overruns = 0) {
    TickRecord record;
    record.tick = number;
    record.totalUs = us;
    record.periodUs = 1000 + us;
    record.overruns = overruns;
    return record;
}

}  // namespace

TEST_CASE("tick history: gives the last two records only if they are consecutive", "[plots]") {
    TickHistory history(8);
    CHECK(history.newest() == nullptr);
    history.push(tickOf(7, 1));
    CHECK(history.newest() == nullptr);
    history.push(tickOf(8, 2));
    REQUIRE(history.newest());
    CHECK(history.newest()->tick == 8);
    CHECK(history.before()->tick == 7);
    history.push(tickOf(10, 3));  // one tick was dropped before it
    CHECK(history.newest() == nullptr);
    history.push(tickOf(0, 4));  // a restart
    CHECK(history.before() == nullptr);
    history.push(tickOf(1, 5));
    CHECK(history.newest()->tick == 1);
    history.clear();
    CHECK(history.newest() == nullptr);
    CHECK(history.pushed() == 5);
}

TEST_CASE("tick history: a tick is late if the count of late ticks has grown", "[plots]") {
    TickHistory history(8);
    for (const std::uint64_t overruns : {5, 5, 6, 6, 8}) history.push(tickOf(history.pushed(), 1, overruns));
    const engine::RingView late = history.view(Channel::Late);
    std::vector<float> values;
    for (std::size_t i = 0; i < late.count; ++i) values.push_back(late[i]);
    CHECK(values == std::vector<float>{0, 0, 1, 0, 1});  // unknown before the first tick
}

TEST_CASE("tick history: percentiles, maximum and late ticks of an interval are those of its ticks", "[plots]") {
    const std::uint32_t seed = 11;
    INFO("seed " << seed);
    std::mt19937 random(seed);
    TickHistory history(300);
    std::vector<double> us;
    std::vector<bool> late;
    std::uint64_t overruns = 0;
    for (int i = 0; i < 1000; ++i) {
        late.push_back(i > 0 && random() % 20 == 0);
        overruns += late.back();
        us.push_back(double(random() % 1000));
        history.push(tickOf(std::uint64_t(i), us.back(), overruns));
    }
    for (const auto& [window, skip] : {std::pair<std::size_t, std::size_t>{300, 0}, {100, 0}, {100, 150}, {1, 299}}) {
        const std::ptrdiff_t end = 1000 - std::ptrdiff_t(skip), begin = end - std::ptrdiff_t(window);
        std::vector<double> part(us.begin() + begin, us.begin() + end);
        const StretchTimes times = stretchTimes(history, {window, skip});
        CHECK(times.ticks == window);
        CHECK(double(times.p50) == *percentile(part, 50));
        CHECK(double(times.p99) == *percentile(part, 99));
        CHECK(double(times.most) == *percentile(part, 100));
        CHECK(double(times.periodMost) == 1000 + *percentile(part, 100));
        CHECK(std::ptrdiff_t(times.late) == std::count(late.begin() + begin, late.begin() + end, true));
    }
    CHECK(stretchTimes(TickHistory(4), {4, 0}).ticks == 0);
}

TEST_CASE("tick history: the exported table has the ticks shown, with every channel", "[plots]") {
    TickHistory history(10);
    for (std::uint64_t i = 0; i < 15; ++i) history.push(tickOf(i, 0.5 * double(i)));
    const TempFolder folder;
    const auto file = folder.path() / "ticks.csv";
    writeTicks(history, {.window = 4, .skip = 3}, file);
    std::ifstream in(file);
    std::string line;
    std::getline(in, line);
    CHECK(line.rfind("tick,total_us,", 0) == 0);
    std::istringstream header(line);
    for (std::string column; std::getline(header, column, ',');) CHECK_NOTHROW(NumericField(column));  // as recorded
    CHECK(std::size_t(std::count(line.begin(), line.end(), ',')) == kChannelCount);
    for (std::uint64_t tick = 8; tick < 12; ++tick) {  // 14 is the newest
        REQUIRE(std::getline(in, line));
        std::istringstream fields(line);
        std::uint64_t number = 0;
        char comma = 0;
        double us = 0;
        fields >> number >> comma >> us;
        CHECK(number == tick);
        CHECK(us == 0.5 * double(tick));
        CHECK(std::size_t(std::count(line.begin(), line.end(), ',')) == kChannelCount);
    }
    CHECK_FALSE(std::getline(in, line));
    CHECK_THROWS(writeTicks(history, {4, 0}, folder.path() / "missing" / "ticks.csv"));
}

}  // namespace touchstone::tick_history_tests
