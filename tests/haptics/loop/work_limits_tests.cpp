#include "haptics/loop/work_limits.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <tuple>

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

TEST_CASE("work limits: a solver on another device is used where its round trip fits, with the updates that fit",
          "[loop]") {
    // They stay in the table, which other tests of this process read.
    const auto make = [](int capacity) { return findSolver("pqp")->make(capacity); };
    addSolver({"far", "another device", false, make, []() -> const RoundTrip& {
                   static const RoundTrip trip{.trouble = "", .us = 300, .updateUs = 4};
                   return trip;
               }});
    addSolver({"absent", "no device", false, make, []() -> const RoundTrip& {
                   static const RoundTrip trip{.trouble = "there is no card"};
                   return trip;
               }});
    const auto kept = [](std::string_view solver, std::string_view shadow, double rate) {
        Settings settings;
        settings.solver = solver;
        settings.shadow = shadow;
        settings.rate = rate;
        const auto sentences = keepRoundTripsInTick(settings, {.solver = 0.4, .shadow = 0.3});
        return std::tuple(settings, sentences);
    };
    {
        const auto [settings, sentences] = kept("far", kNoSolver, 1000);  // 380 of 400 µs
        CHECK(settings.solver == "far");
        CHECK(sentences.empty());
        const Settings limited = limitWork(settings, 2, {.solver = 0.4, .shadow = 0.3});
        CHECK(limited.iterationCap == 25);  // (400 - 300) / 4
        CHECK(limited.solverWait == Approx(400));
    }
    {
        const auto [settings, sentences] = kept("far", "far", 1000);  // 300 µs for the shadow
        CHECK(settings.solver == "far");
        CHECK(settings.shadow == "pqp");
        REQUIRE(sentences.size() == 1);
        CHECK(sentences[0] ==
              "far is not used here, and pqp solves on the processor: its round trip with 20 updates takes 380 µs, and "
              "a tick at 1000 Hz has 300 µs for it");
    }
    {
        const auto [settings, sentences] = kept("absent", "pqp", 250);
        CHECK(settings.solver == "pqp");
        CHECK(settings.shadow == "pqp");
        REQUIRE(sentences.size() == 1);
        CHECK(sentences[0] == "absent is not used here, and pqp solves on the processor: there is no card");
    }
    const auto [settings, sentences] = kept(kExactSolver, kNoSolver, 1000);
    CHECK(sentences.empty());
    CHECK(std::isinf(limitWork(settings, 2).solverWait));
}

TEST_CASE("work limits: the calibration measures a positive time", "[loop]") {
    const double ns = calibrateWork();
    CHECK(std::isfinite(ns));
    CHECK(ns > 0);
    CHECK(limitWork({}, ns).shadowWork >= 1);
}

}  // namespace touchstone::work_limits_tests
