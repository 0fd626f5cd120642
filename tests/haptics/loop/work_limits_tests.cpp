#include "haptics/loop/work_limits.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace touchstone::work_limits_tests {

TEST_CASE("work limits: shares of the period become counts, and never raise a setting", "[loop]") {
    Settings settings;  // 1 kHz: 1e6 ns
    const Settings limited = limitWork(settings, 2, {.solver = 0.4, .shadow = 0.3});
    CHECK(limited.solverWork == 200'000);
    CHECK(limited.shadowWork == 150'000);
    CHECK(limited.iterationCap == settings.iterationCap);  // the limit would be 150,000 / 32 = 4,687
    CHECK(limited.paperWork == settings.paperWork);

    settings.rate = 10'000;
    CHECK(limitWork(settings, 2, {.solver = 0.4, .shadow = 0.3}).shadowWork == 15'000);
    CHECK(limitWork(settings, 2, {.solver = 0.4, .shadow = 0.3}).iterationCap == 468);  // 15,000 / 32
    settings.shadowWork = 100;
    CHECK(limitWork(settings, 2).shadowWork == 100);
    CHECK(limitWork(settings, 1e12).shadowWork == 1);  // a setting of zero would be out of range
    CHECK(checkSettings(limitWork(settings, 1e12)) == "");
}

TEST_CASE("work limits: the calibration measures a positive time", "[loop]") {
    const double ns = calibrateWork();
    CHECK(std::isfinite(ns));
    CHECK(ns > 0);
    CHECK(limitWork({}, ns).shadowWork >= 1);
}

}  // namespace touchstone::work_limits_tests
