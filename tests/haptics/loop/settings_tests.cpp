#include "haptics/loop/settings.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "haptics/loop/setting_table.hpp"
#include "haptics/qp/friction_table.hpp"

namespace touchstone::settings_tests {

TEST_CASE("settings: the defaults are in range and consistent, and their text equals the struct", "[loop]") {
    const Settings settings;
    CHECK(checkSettings(settings) == "");
    CHECK(getSetting(settings, "mode") == "default");
    CHECK(getSetting(settings, "solver") == "dual-active-set");
    CHECK(getSetting(settings, "shadow") == "pqp");
    CHECK(getSetting(settings, "margin") == "0.5");
    CHECK(getSetting(settings, "torsion") == "1000");
    CHECK(getSetting(settings, "linearizations") == "0");
    CHECK(getSetting(settings, "geometry") == "mesh");
    CHECK(getSetting(settings, "paper_work") == "100000000");
    CHECK(getSetting(settings, "adaptive_margin") == "on");
    CHECK(getSetting(settings, "pause") == "off");
}

TEST_CASE("settings: a key of an earlier version sets the one of today", "[loop]") {
    Settings settings;
    CHECK(setSetting(settings, "linearisations", "3") == "");
    CHECK(getSetting(settings, "linearizations") == "3");
    CHECK_THAT(setSetting(settings, "linearisations", "1.5"), Catch::StartsWith("linearizations must be"));
}

TEST_CASE("settings: every key reads back the bits that it wrote", "[loop]") {
    const unsigned seed = std::random_device{}();
    INFO("seed " << seed);
    std::mt19937_64 random(seed);
    for (int round = 0; round < 200; ++round) {
        Settings from;
        for (const SettingInfo& info : settingTable()) {
            if (info.max == 0) continue;
            const double share = std::uniform_real_distribution<double>(0, 1)(random);
            const double number = info.min + share * (info.max - info.min);
            const bool whole = setSetting(from, info.key, "1.5").find("whole") != std::string::npos;
            char text[64];
            std::snprintf(text, sizeof text, "%.17g", whole ? std::floor(number) : number);
            REQUIRE(setSetting(from, info.key, text) == "");
        }
        from.mode = random() % 2 ? Mode::Paper : Mode::Default;
        from.solver = solverTable()[random() % solverTable().size()].name;
        from.shadow = random() % 4 ? solverTable()[random() % solverTable().size()].name : kNoSolver;
        from.adaptiveMargin = random() % 2;
        from.screening = static_cast<Screening>(random() % 3);
        from.pause = random() % 2;

        Settings to;
        for (const SettingInfo& info : settingTable()) {
            const std::string value = getSetting(from, info.key);
            INFO(info.key << " = " << value);
            REQUIRE(setSetting(to, info.key, value) == "");
            REQUIRE(getSetting(to, info.key) == value);
        }
        // Compare members, not text: this detects two values with the same text.
        REQUIRE(to.stiffness == from.stiffness);
        REQUIRE(to.torsion == from.torsion);
        REQUIRE(to.tolerance == from.tolerance);
        REQUIRE(to.margin == from.margin);
        REQUIRE(to.rate == from.rate);
        REQUIRE(to.paperWork == from.paperWork);
        REQUIRE(to.shadowRows == from.shadowRows);
        REQUIRE(to.solver == from.solver);
        REQUIRE(to.shadow == from.shadow);
        REQUIRE(to.mode == from.mode);
        REQUIRE(to.screening == from.screening);
        REQUIRE(to.pause == from.pause);
    }
}

TEST_CASE("settings: the limits are accepted, and values beyond them are refused by name", "[loop]") {
    for (const SettingInfo& info : settingTable()) {
        if (info.max == 0) continue;
        INFO(info.key);
        Settings settings;
        for (const double limit : {info.min, info.max}) {
            char text[64];
            std::snprintf(text, sizeof text, "%.17g", limit);
            CHECK(setSetting(settings, info.key, text) == "");
        }
        const std::string before = getSetting(settings, info.key);
        char beyond[64];
        std::snprintf(beyond, sizeof beyond, "%.17g", info.max * 1.001 + 1);
        const std::string_view refused[] = {"-1", beyond, "nan", "-nan", "inf", "", " ", "1x", "one", "1,5"};
        for (const std::string_view value : refused) {
            const std::string sentence = setSetting(settings, info.key, value);
            INFO(value << ": " << sentence);
            CHECK(sentence.find(std::string(info.key) + " must be a") == 0);
            CHECK(sentence.find(" from ") != std::string::npos);
            CHECK(getSetting(settings, info.key) == before);
        }
    }
}

TEST_CASE("settings: error messages say what is accepted", "[loop]") {
    Settings settings;
    CHECK(setSetting(settings, "rate", "100") == "rate must be a number from 250 to 10000 Hz, not '100'");
    CHECK(setSetting(settings, "linearizations", "1.5") ==
          "linearizations must be a whole number from 0 to 64, not '1.5'");
    CHECK(setSetting(settings, "paper_work", "1e8") == "");
    CHECK(settings.paperWork == 100'000'000);
    CHECK(setSetting(settings, "pause", "maybe") == "pause must be on or off, not 'maybe'");
    CHECK(setSetting(settings, "mode", "papery") == "mode must be default, paper, penalty or god-object, not 'papery'");
    std::string solvers;
    for (const SolverInfo& info : solverTable()) solvers += std::string(info.name) + ", ";
    CHECK(setSetting(settings, "solver", "none") == "solver must be one of " + solvers + "not 'none'");
    CHECK(setSetting(settings, "shadow", "simplex") == "shadow must be one of " + solvers + "none, not 'simplex'");
    CHECK(setSetting(settings, "shadow", "none") == "");
    CHECK(settings.shadow == kNoSolver);
    CHECK(getSetting(settings, "shadow") == "none");
    CHECK(setSetting(settings, "stifness", "1") == "there is no setting 'stifness': did you mean 'stiffness'?");
    const std::string unknown = setSetting(settings, "colour", "1");
    for (const SettingInfo& info : settingTable()) CHECK(unknown.find(info.key) != std::string::npos);
}

TEST_CASE("settings: every row has a help sentence and a unique key", "[loop]") {
    for (const SettingInfo& info : settingTable()) {
        CHECK(!info.help.empty());
        CHECK(info.min <= info.max);
        int same = 0;
        for (const SettingInfo& other : settingTable()) same += other.key == info.key;
        CHECK(same == 1);
    }
}

TEST_CASE("settings: values set directly in the struct are also checked", "[loop]") {
    Settings settings;
    settings.trust = 0.6;
    CHECK(checkSettings(settings) ==
          "trust is 0.6 mm but must be at most the margin of 0.5 mm: lower trust or raise margin");
    settings.margin = 0.6;
    CHECK(checkSettings(settings) == "");
    settings.rate = std::numeric_limits<double>::quiet_NaN();
    CHECK(checkSettings(settings) == "rate must be a number from 250 to 10000 Hz, not 'nan'");
    settings = {};
    settings.solver = "simplex";
    CHECK(checkSettings(settings).find("solver must be one of") == 0);
    settings.solver = kNoSolver;
    CHECK(checkSettings(settings).find("solver must be one of") == 0);
    settings = {};
    settings.shadow = "";
    CHECK(checkSettings(settings).find("shadow must be one of") == 0);
    settings = {};
    settings.frictionSolver = "pqp";
    CHECK(checkSettings(settings).find("friction_solver must be one of cone-newton, ") == 0);
    settings = {};
    settings.frictionShadow = kNoSolver;
    CHECK(checkSettings(settings).find("friction_shadow must be one of") == 0);
}

TEST_CASE("settings: friction solvers have names of their own", "[settings]") {
    Settings settings;
    CHECK(findFrictionSolver(settings.frictionSolver)->exact);
    CHECK(getSetting(settings, "friction_shadow") == "convex");
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        CHECK(setSetting(settings, "friction_solver", info.name).empty());
        CHECK(getSetting(settings, "friction_solver") == info.name);
    }
    for (const char* key : {"friction_solver", "friction_shadow"})
        for (const char* wrong : {"pqp", "none", ""}) CHECK_FALSE(setSetting(settings, key, wrong).empty());
    CHECK_FALSE(setSetting(settings, "solver", "lemke-8").empty());
    CHECK(settingChoices("friction_solver").size() == frictionSolverTable().size());
}

}  // namespace touchstone::settings_tests
