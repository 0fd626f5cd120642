// Phases of synthetic ticks, protocols, and confidence intervals of a summary.
#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "haptics/device/safety.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/sandbox/trials/phases.hpp"
#include "haptics/sandbox/trials/protocol.hpp"
#include "haptics/sandbox/trials/trial.hpp"

namespace touchstone::trials_tests {

using namespace touchstone::sandbox;
using nlohmann::ordered_json;

namespace {

/// A hole 20 mm deep along world y, its mouth at y = 0 of the tool's origin, for a tool with eight keys.
GoalRegion hole() {
    GoalRegion goal;
    goal.X_WT.p = {0, -20, 0};
    goal.tolerance = 0.5;
    goal.toleranceAngle = 0.05;
    goal.hold = 500;
    goal.depth = 20;
    goal.fold = 8;
    return goal;
}

/// A trial of synthetic ticks of 1 ms.
class Made {
  public:
    explicit Made(const PhaseLimits& limits = {}) : watch(hole(), limits) {}

    Phase stay(int ms, const Vec3& p, double force, double tilt = 0, double twist = 0) {
        TickRecord tick;
        tick.X_WT = {p, expRotation({tilt, 0, 0}) * expRotation({0, twist, 0})};
        tick.wrench_C.force = {0, force, 0};
        for (int i = 0; i < ms; ++i) watch.add(tick, 1);
        return watch.phase();
    }
    PhaseWatch watch;
};

const Vec3 kAbove(0, 5, 0), kBeside(2, 0, 0), kOver(0.2, 0, 0), kIn(0.1, -10, 0), kHome(0.1, -20, 0.1);

ordered_json study() {
    return {{"format", "touchstone trials"},
            {"version", 1},
            {"seed", 3},
            {"repetitions", 2},
            {"participants", {"ada", 17, "bob"}},
            {"conditions",
             {{{"scene", "spline"}},
              {{"name", "pqp"}, {"scene", "spline"}, {"solver", "pqp"}, {"tolerance", 0.1}},
              {{"name", "soft"}, {"scene", "spline-05"}, {"stiffness", 0.5}, {"time_limit_s", 5}}}}};
}

}  // namespace

TEST_CASE("phases: approach, search, align, insert and seated follow from pose and contact", "[trials]") {
    Made trial;
    CHECK(trial.stay(100, kAbove, 0) == Phase::Approach);
    CHECK_FALSE(trial.watch.firstContact());
    CHECK(trial.stay(50, kBeside, 1) == Phase::Search);
    CHECK(trial.watch.firstContact() == 101.0);
    CHECK(trial.stay(40, kBeside, 0) == Phase::Search);  // a lifted tool stays in search
    CHECK(trial.stay(30, kOver, 1) == Phase::Align);
    CHECK(trial.stay(20, {0.2, -0.9, 0}, 1) == Phase::Align);  // less than 1 mm deep does not count as in
    CHECK(trial.stay(10, kIn, 1) == Phase::Insert);
    CHECK(trial.watch.depth() == Approx(10));
    CHECK(trial.stay(5, {0, -0.6, 0}, 1) == Phase::Insert);  // after insertion, half of that still counts as in
    CHECK(trial.stay(5, {0, -0.4, 0}, 1) == Phase::Align);
    CHECK(trial.stay(10, kIn, 1) == Phase::Insert);
    CHECK(trial.stay(10, kHome, 3) == Phase::Insert);  // pressed home is not released
    CHECK(trial.stay(499, kHome, 0) == Phase::Seated);
    CHECK_FALSE(trial.watch.end());
    CHECK(trial.stay(1, kHome, 0) == Phase::Seated);
    CHECK(trial.watch.end() == TrialEnd::Seated);
    CHECK(trial.watch.milliseconds(Phase::Approach) == 100);
    CHECK(trial.watch.milliseconds(Phase::Search) == 90);
    CHECK(trial.watch.milliseconds(Phase::Align) == 55);
    CHECK(trial.watch.milliseconds(Phase::Insert) == 35);
    CHECK(trial.watch.milliseconds(Phase::Seated) == 500);
    CHECK(trial.watch.elapsed() == 780);
    CHECK(trial.watch.jams() == 0);
}

TEST_CASE("phases: a tilted tool over the hole is not in it", "[trials]") {
    Made trial;
    trial.stay(1, kOver, 1);
    CHECK(trial.stay(10, {0, -2, 0}, 1, 0.2) == Phase::Align);
    CHECK(trial.stay(10, {0, -2, 0}, 1, 0.05) == Phase::Insert);
}

TEST_CASE("phases: a tool beside the block is not in the hole", "[trials]") {
    Made trial;
    trial.stay(1, kOver, 1);
    CHECK(trial.stay(5000, {10, -15, 0}, 5) ==
          Phase::Search);  // equally deep and upright, but pressed against the side of the block
    CHECK(trial.watch.jams() == 0);
    CHECK(trial.stay(10, {1, -2, 0}, 1, 0.05) == Phase::Insert);  // leaning on the rim counts as in
}

TEST_CASE("phases: a tool is seated only if released, at a fitting angle, and still", "[trials]") {
    Made trial;
    SECTION("pressed") { trial.stay(5000, kHome, 0.2); }
    SECTION("twisted between two keyways") {
        trial.stay(1, kIn, 1);
        trial.stay(5000, kHome, 0, 0, std::numbers::pi / 8);
    }
    SECTION("short of the bottom") {
        trial.stay(1, kIn, 1);
        trial.stay(5000, {0, -19, 0}, 0);
    }
    SECTION("placed there without contact") { trial.stay(5000, kHome, 0); }
    SECTION("moving after release") {
        trial.stay(1, kIn, 1);
        for (int i = 0; i < 5000; ++i) trial.stay(1, {0.2 * std::sin(i / 30.0), -20, 0}, 0);
    }
    CHECK_FALSE(trial.watch.end());
}

TEST_CASE("phases: eight keys fit in eight orientations", "[trials]") {
    for (int key = -8; key <= 8; ++key) {
        Made trial;
        trial.stay(1, kIn, 1);
        trial.stay(500, kHome, 0, 0, key * std::numbers::pi / 4 + 0.04);
        INFO(key);
        CHECK(trial.watch.end() == TrialEnd::Seated);
    }
    GoalRegion goal = hole();
    goal.fold = 1;
    CHECK(goal.angle({Vec3::Zero(), expRotation({0, 0.3, 0})}) == Approx(0.3));
    CHECK(goal.angle({Vec3::Zero(), expRotation({0, -3, 0})}) == Approx(3));
}

TEST_CASE("phases: pressing in the hole without progress is a jam until it moves on", "[trials]") {
    Made trial;
    trial.stay(2000, kOver, 5);  // on the rim is not a jam
    CHECK(trial.watch.jams() == 0);
    trial.stay(400, kIn, 3);
    CHECK_FALSE(trial.watch.jammed());
    trial.stay(200, kIn, 3);
    CHECK(trial.watch.jammed());
    trial.stay(2000, kIn, 3);
    CHECK(trial.watch.jams() == 1);  // still the same jam
    trial.stay(10, kIn, 1);          // the hand yields
    CHECK_FALSE(trial.watch.jammed());
    trial.stay(600, kIn, 3);
    CHECK(trial.watch.jams() == 2);
    for (int i = 0; i < 2000; ++i)
        trial.stay(1, {0, -10 - 0.004 * i, 0}, 3);  // a large force with progress: 2 mm in 500 ms
    CHECK(trial.watch.jams() == 2);
    trial.stay(2000, kHome, 6);  // on the bottom
    CHECK(trial.watch.jams() == 2);
    CHECK_FALSE(trial.watch.end());
}

TEST_CASE("phases: drawing back after contact is an abort", "[trials]") {
    Made trial;
    trial.stay(10, {0, 30, 0}, 0);
    CHECK_FALSE(trial.watch.end());
    trial.stay(10, kBeside, 1);
    trial.stay(10, {0, 14, 0}, 0);
    CHECK_FALSE(trial.watch.end());
    trial.stay(1, {0, 16, 0}, 0);
    CHECK(trial.watch.end() == TrialEnd::Abort);
}

TEST_CASE("phases: a way that leads up may be followed up, and drawing back is down", "[trials]") {
    GoalRegion goal = hole();
    goal.depth = 0;
    goal.way = {{{0, -45, 0}, Quat::Identity()}};
    PhaseWatch watch(goal);
    const auto at = [&](double y, double force) {
        TickRecord tick;
        tick.X_WT.p = goal.X_WT * Vec3(0, y, 0);
        tick.wrench_C.force = {0, force, 0};
        watch.add(tick, 1);
    };
    at(-30, 1);
    at(-2, 0);
    CHECK_FALSE(watch.end());
    at(-44, 0);
    CHECK_FALSE(watch.end());
    at(-46, 0);
    CHECK(watch.end() == TrialEnd::Abort);
}

TEST_CASE("trials: a guard that keeps acting counts as one trip", "[trials]") {
    TrialMeasures measures(hole(), {});
    const std::uint32_t stale = bit(Trip::StaleReading), clamped = bit(Trip::ForceClamped);
    TickRecord tick;
    for (const std::uint32_t acting : {stale, stale, stale | clamped, clamped, 0u, stale}) {
        tick.trips = acting;
        measures.add(tick, 1);
    }
    CHECK(measures.trips() == 3);
}

TEST_CASE("protocol: every participant does every condition, in a reproducible individual order", "[trials]") {
    const Protocol protocol = readProtocol(study(), "study.json");
    const std::vector<Trial> trials = protocol.trials();
    REQUIRE(trials.size() == 3 * 3 * 2);
    std::set<std::tuple<int, int, int>> seen;
    std::set<std::vector<int>> orders;
    std::set<std::uint64_t> seeds;
    for (int p = 0; p < 3; ++p) {
        std::vector<int> order;
        for (int i = 0; i < 6; ++i) {
            const Trial& trial = trials[static_cast<std::size_t>(6 * p + i)];
            CHECK(trial.number == 6 * p + i + 1);
            CHECK(trial.order == i + 1);
            CHECK(trial.participant == p);
            seen.insert({p, trial.condition, trial.repetition});
            seeds.insert(trial.seed);
            order.push_back(3 * trial.repetition + trial.condition);
        }
        orders.insert(order);
    }
    CHECK(seen.size() == 18);
    CHECK(seeds.size() == 6);  // one random seed for each participant and repetition, the same under every condition
    CHECK(orders.size() > 1);
    const std::vector<Trial> again = readProtocol(study(), "study.json").trials();
    for (std::size_t i = 0; i < trials.size(); ++i) {
        CHECK(again[i].condition == trials[i].condition);
        CHECK(again[i].seed == trials[i].seed);
    }

    ordered_json fixed = study();
    fixed["order"] = "fixed";
    const std::vector<Trial> listed = readProtocol(fixed, "study.json").trials();
    for (int i = 0; i < 18; ++i) {
        CHECK(listed[static_cast<std::size_t>(i)].condition == i % 3);
        CHECK(listed[static_cast<std::size_t>(i)].repetition == i / 3 % 2 + 1);
    }
}

TEST_CASE("protocol: a condition changes the scene's settings, and names itself", "[trials]") {
    const Protocol protocol = readProtocol(study(), "study.json");
    REQUIRE(protocol.conditions.size() == 3);
    CHECK(protocol.conditions[0].name == "spline");
    CHECK(protocol.conditions[0].device == "insert");
    CHECK(protocol.conditions[2].timeLimit == 5);
    Settings scene;
    scene.margin = 0.2;
    scene.trust = 0.2;
    const Settings pqp = protocol.conditions[1].settings(scene), soft = protocol.conditions[2].settings(scene);
    CHECK(getSetting(pqp, "solver") == "pqp");
    CHECK(pqp.tolerance == 0.1);
    CHECK(pqp.margin == 0.2);
    CHECK(pqp.shadow == kNoSolver);
    CHECK(soft.stiffness == 0.5);
    CHECK(soft.solver == scene.solver);
    ordered_json two = study();
    two["conditions"] = {{{"scene", "spline"}}, {{"scene", "spline"}, {"device", "mouse"}, {"time_limit_s", 60}}};
    CHECK(readProtocol(two, "study.json").conditions[1].name == "spline device=mouse time_limit_s=60");
    ordered_json paper = study();
    paper["conditions"] = {{{"scene", "spline"}, {"mode", "paper"}, {"settings", {{"paper_rows", 200}}}}};
    const Condition condition = readProtocol(paper, "study.json").conditions[0];
    CHECK(condition.name == "spline mode=paper paper_rows=200");
    CHECK(condition.settings(scene).mode == Mode::Paper);
    CHECK(condition.settings(scene).paperRows == 200);
    CHECK(condition.settings(scene).shadow == kNoSolver);
}

TEST_CASE("protocol: an error is one sentence with the file's name and the field", "[trials]") {
    const auto refused = [](const std::string& pointer, const ordered_json& value, const std::string& field) {
        ordered_json source = study();
        source[ordered_json::json_pointer(pointer)] = value;
        INFO(pointer << " " << value);
        try {
            readProtocol(source, "study.json");
            FAIL("accepted");
        } catch (const std::runtime_error& error) {
            const std::string what = error.what();
            INFO(what);
            CHECK(what.rfind("study.json: " + field, 0) == 0);
            CHECK(what.find('\n') == std::string::npos);
        }
    };
    refused("/format", "trials", "format must be");
    refused("/version", 2, "version must be");
    refused("/seed", -1, "seed must be");
    refused("/seed", 7.9, "seed must be a whole number");
    refused("/repetitions", 1.5, "repetitions must be a whole number");
    refused("/order", "shuffled", "order must be");
    refused("/participants", ordered_json::array(), "participants must be");
    refused("/participants", 0, "participants must be");
    refused("/participants/1", "ada", "participants must be different");
    refused("/participants/1", 1.5, "participants must be");
    refused("/conditions", ordered_json::array(), "conditions must be");
    refused("/conditions/0", 3, "conditions[0] must be an object");
    refused("/conditions/0/scene", 3, "conditions[0].scene must be");
    refused("/conditions/1/solver", "simplex", "conditions[1].solver must be");
    refused("/conditions/1/stiffness", -1, "conditions[1].stiffness must be a number from");
    refused("/conditions/1/settings", 3, "conditions[1].settings must be an object");
    refused("/conditions/1/settings", {{"trust", -1}}, "conditions[1].settings.trust must be a number from");
    refused("/conditions/1/settings", {{"trusts", 1}}, "conditions[1].settings.trusts must be left out: there is no");
    refused("/conditions/1/settings", {{"shadow", "pqp"}}, "conditions[1].settings.shadow must be left out");
    refused("/conditions/1/settings", {{"pause", true}}, "conditions[1].settings.pause must be left out");
    refused("/conditions/1/settings", {{"mode", "paper"}}, "conditions[1].settings.mode must be left out here");
    refused("/conditions/1/settings", {{"solver", "pqp"}}, "conditions[1].settings.solver must be left out here");
    refused("/conditions/1/colour", "red", "conditions[1].colour must be left out");
    refused("/conditions/1/name", "soft", "conditions[2].name must be different");
    refused("/conditions/1/name", "so\"ft", "conditions[1].name must be");
    refused("/conditions/2/time_limit_s", 0, "conditions[2].time_limit_s must be");
    refused("/jam", {{"force", 1}}, "jam.force must be left out");
    refused("/breaks", true, "breaks must be left out");
    ordered_json none = study();
    none["conditions"][0].erase("scene");
    CHECK_THROWS_WITH(readProtocol(none, "study.json"), Catch::Contains("conditions[0].scene must be given"));
    CHECK_THROWS_WITH(readProtocol(std::filesystem::path("nowhere.json")), Catch::Contains("nowhere.json"));
}

}  // namespace touchstone::trials_tests
