#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "haptics/sandbox/scene/outcome.hpp"
#include "tests/support/scene_maker.hpp"

namespace touchstone::outcome_tests {

using namespace touchstone::test;
using Catch::Matchers::Contains;
using nlohmann::json;
using sandbox::OutcomeCheck;

namespace {

/// A tick with the tool at `x` mm and a force of `force` N.
TickRecord tickAt(double x, double force, double lag = 0) {
    TickRecord record;
    record.X_WT.p = Vec3(x, 0, 0);
    record.X_WT_device.p = Vec3(x - lag, 0, 0);
    record.wrench_C.force = Vec3(force, 0, 0);
    return record;
}

struct Fixture {
    engine::Scene scene;
    sandbox::SceneRoles roles;
    std::vector<std::string> warnings;

    explicit Fixture(const json& outcome) {
        scene.file = "expected.glb";
        roles.tool = addBox(scene, "tool", glm::vec3(0.01f));
        roles.outcome = outcome;
    }
    sandbox::ExpectedOutcome read() { return readOutcome(scene, roles, warnings); }
};

const OutcomeCheck& find(const std::vector<OutcomeCheck>& checks, const std::string& name) {
    for (const OutcomeCheck& check : checks)
        if (check.name == name) return check;
    FAIL("no check " << name);
    return checks.front();
}

}  // namespace

TEST_CASE("outcome: checks use the greatest value, the last value or a share of all ticks", "[sandbox]") {
    Fixture f({{"max_penetration_mm", 0.001},
               {"max_hover_mm", 0.2},
               {"min_peak_force_N", 3},
               {"max_peak_force_N", 4},
               {"max_peak_torque_mNm", 10},
               {"min_peak_torque_mNm", 13},
               {"max_dforce_N_per_ms", 2.5},
               {"min_contact_fraction", 0.5},
               {"max_final_lag_mm", 0.1},
               {"max_infeasible_ticks", 0}});
    sandbox::OutcomeJudge judge(f.read());
    CHECK(f.warnings.empty());
    TickRecord record = tickAt(0, 0);
    judge.add(record, 0, 0.5);
    record = tickAt(1, 1);
    record.hover = 0.3;
    judge.add(record, 0.0005, 0.5);  // 1 N in half a ms: 2 N/ms
    record = tickAt(2, -3.5 + 5.5, 0.05);
    record.wrench_C.torque = Vec3(0, 0, 12);
    record.flags = kInfeasible;
    judge.add(record, 0.002, 0.5);
    record = tickAt(3, 3.2, 0.05);
    judge.add(record, 0, 0.5);

    const auto checks = judge.checks(true);
    CHECK(checks.size() == 10);
    const auto is = [&](const char* name, double value, bool met) {
        INFO(name);
        const OutcomeCheck& check = find(checks, name);
        CHECK(check.value == Approx(value));
        CHECK(check.met == met);
    };
    is("max_penetration_mm", 0.002, false);
    is("max_hover_mm", 0.3, false);
    is("min_peak_force_N", 3.2, true);
    is("max_peak_force_N", 3.2, true);
    is("max_peak_torque_mNm", 12, false);
    is("min_peak_torque_mNm", 12, false);
    is("max_dforce_N_per_ms", 2.4, true);  // from 2 to 3.2 N in half a ms
    is("min_contact_fraction", 0.75, true);
    is("max_final_lag_mm", 0.05, true);
    is("max_infeasible_ticks", 1, false);
}

TEST_CASE("outcome: before the end only the checks of all times are evaluated", "[sandbox]") {
    Fixture f({{"max_penetration_mm", 0.001},
               {"min_peak_force_N", 3},
               {"min_peak_torque_mNm", 3},
               {"max_final_lag_mm", 1},
               {"final_position_m", {0, 0, 0}}});
    sandbox::OutcomeJudge judge(f.read());
    judge.add(tickAt(0, 1), 0, 1);
    const auto checks = judge.checks(false);
    REQUIRE(checks.size() == 1);
    CHECK(checks[0].name == "max_penetration_mm");
    CHECK(judge.checks(true).size() == 5);
}

TEST_CASE("outcome: seated means within both tolerances for the whole hold time at the end", "[sandbox]") {
    Fixture f(json{{"seated", true}});
    CHECK_THROWS_WITH(f.read(), Contains("expected.glb") && Contains("seated") && Contains("goal"));
    f.roles.goal =
        GoalRegion{.X_WT = {Vec3(10, 0, 0), Quat::Identity()}, .tolerance = 0.5, .toleranceAngle = 0.1, .hold = 3};
    sandbox::OutcomeJudge judge(f.read());
    const auto met = [&] {
        bool all = true;
        for (const OutcomeCheck& check : judge.checks(true)) all = all && check.met;
        return all;
    };
    for (int i = 0; i < 3; ++i) judge.add(tickAt(10.2, 0), 0, 1);
    CHECK(met());
    CHECK(find(judge.checks(true), "seated_hold_s").value == Approx(0.003));
    judge.add(tickAt(10.6, 0), 0, 1);  // once outside: the hold time restarts
    CHECK_FALSE(met());
    for (int i = 0; i < 2; ++i) judge.add(tickAt(10, 0), 0, 1);
    CHECK_FALSE(met());
    judge.add(tickAt(10, 0), 0, 1);
    CHECK(met());
    TickRecord turned = tickAt(10, 0);
    turned.X_WT.q = expRotation(Vec3(0, 0, 0.11));
    judge.add(turned, 0, 1);
    CHECK_FALSE(met());
    CHECK(find(judge.checks(true), "seated_angle_rad").value == Approx(0.11));
}

TEST_CASE("outcome: positions are given in meters", "[sandbox]") {
    Fixture f({{"final_position_m", {0.01, 0, 0}},
               {"final_tolerance_m", 0.0002},
               {"tool_within_m", {{"min", {0, -1, -1}}, {"max", {0.02, 1, 1}}}}});
    sandbox::OutcomeJudge judge(f.read());
    judge.add(tickAt(21, 0), 0, 1);  // 1 mm outside the box
    judge.add(tickAt(10.1, 0), 0, 1);
    const auto checks = judge.checks(true);
    CHECK(find(checks, "final_position_m").value == Approx(0.0001));
    CHECK(find(checks, "final_position_m").met);
    CHECK(find(checks, "tool_within_m").value == Approx(0.001));
    CHECK_FALSE(find(checks, "tool_within_m").met);
}

TEST_CASE("outcome: unknown keys are named, wrong types are refused, and no keys mean no checks", "[sandbox]") {
    Fixture unknown(json{{"max_penetration_m", 1}});
    CHECK(unknown.read().empty());
    REQUIRE(unknown.warnings.size() == 1);
    CHECK_THAT(unknown.warnings[0], Contains("outcome.max_penetration_m"));
    for (const json& wrong : std::vector<json>{{{"max_hover_mm", "small"}},
                                               {{"seated", 1}},
                                               {{"tool_within_m", {{"min", {0, 0, 0}}}}},
                                               {{"final_position_m", {0, 0}}},
                                               {{"max_hover_mm", -1}}}) {
        INFO(wrong.dump());
        Fixture f(wrong);
        CHECK_THROWS_WITH(f.read(), Contains("node 0 \"tool\"") && Contains("extras.touchstone.outcome"));
    }
    Fixture none(nullptr);
    CHECK(none.read().empty());
    CHECK(sandbox::OutcomeJudge(none.read()).checks(true).empty());
}

TEST_CASE("outcome: every key of the table is read", "[sandbox]") {
    for (const sandbox::OutcomeKey& key : sandbox::outcomeTable()) {
        INFO(key.key);
        CHECK_FALSE(key.what.empty());
        Fixture f(json::object({{std::string(key.key), nullptr}}));
        // No key accepts null: a known key is refused, an unknown key becomes a warning.
        CHECK_THROWS(f.read());
    }
}

}  // namespace touchstone::outcome_tests
