#include <catch2/catch.hpp>

#include <nlohmann/json.hpp>
#include <numbers>

#include "haptics/sandbox/panels/status_bar.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "tests/support/scene_maker.hpp"

namespace touchstone::gauge_tests {

using namespace touchstone::test;
using Catch::Matchers::Contains;
using nlohmann::json;

namespace {

const glm::vec3 kSize(0.01f);

engine::Entity addMarked(engine::Scene& scene, const char* name, const json& mark,
                         const engine::LocalTransform& local = {}) {
    const engine::Entity node = addNode(scene, name, {}, local);
    setExtras(scene, node, {{"touchstone", mark}});
    return node;
}

sandbox::SceneRoles rolesOf(engine::Scene& scene) {
    scene.file = "pocket.glb";
    updateWorldTransforms(scene);
    return sandbox::assignRoles(scene);
}

}  // namespace

TEST_CASE("gauge: reads the depth of the tool's point below any plane", "[sandbox]") {
    engine::Scene scene;
    addBox(scene, "probe", kSize, {{"role", "tool"}});
    // Turned by -90° about z: its +y is the scene's +x.
    addMarked(scene, "margin", {{"role", "gauge"}, {"gauge", {{"tip_m", {0, -0.005, 0}}}}},
              {.translation = {0.02, 0, 0}, .rotation = glm::angleAxis(-std::numbers::pi / 2, glm::dvec3(0, 0, 1))});
    const sandbox::SceneRoles roles = rolesOf(scene);
    CHECK(roles.warnings.empty());
    REQUIRE(roles.gauge);
    CHECK(roles.gauge->name == "margin");
    // The point is 5 mm below the tool's origin; with the tool at x = 12 it is 8 mm behind the plane x = 20.
    CHECK(roles.gauge->depth({Vec3(12, 7, 3), Quat::Identity()}) == Approx(8));
    // Turned by 90° about z the point is at +x of the origin.
    const Quat turned(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ()));
    CHECK(roles.gauge->depth({Vec3(12, 7, 3), turned}) == Approx(3));
    CHECK(roles.gauge->depth({Vec3(24, 0, 0), Quat::Identity()}) == Approx(-4));
}

TEST_CASE("gauge: the status bar shows the reading", "[sandbox]") {
    LoopSnapshot snapshot;
    snapshot.record.X_WT.p.y() = -2.346;
    const std::string device = "mouse";
    const sandbox::Gauge gauge{.name = "margin", .X_WG = {}};
    const auto last = [&](const sandbox::Gauge* shown) {
        return sandbox::healthItems({&snapshot, nullptr, device, {}, {}, nullptr, shown}).back();
    };
    CHECK(last(&gauge).name == std::string("Depth"));
    CHECK(last(&gauge).value == "2.35 mm");
    CHECK_THAT(last(&gauge).help, Contains("margin"));
    CHECK(last(nullptr).name != std::string("Depth"));
}

TEST_CASE("gauge: bad markings are refused in one sentence", "[sandbox]") {
    const auto opened = [](const json& mark) {
        engine::Scene scene;
        addMarked(scene, "margin", mark);
        return rolesOf(scene);
    };
    CHECK_THROWS_WITH(opened({{"role", "gauge"}, {"gauge", 5}}),
                      Contains("pocket.glb") && Contains("margin") && Contains("gauge must be an object"));
    CHECK_THROWS_WITH(opened({{"role", "gauge"}, {"gauge", {{"tip_m", 5}}}}),
                      Contains("margin") && Contains("extras.touchstone.gauge.tip_m must be"));
    CHECK_THAT(opened({{"role", "gauge"}, {"gauge", {{"tip_mm", {0, 0, 0}}}}}).warnings.at(0), Contains("tip_mm"));
    CHECK_THAT(opened({{"role", "visual"}, {"gauge", json::object()}}).warnings.at(0),
               Contains("margin") && Contains("no effect"));

    engine::Scene two;
    addMarked(two, "first", {{"role", "gauge"}});
    addMarked(two, "second", {{"role", "gauge"}});
    const sandbox::SceneRoles roles = rolesOf(two);
    CHECK(roles.gauge->name == "first");
    CHECK_THAT(roles.warnings.at(0), Contains("second") && Contains("first comes first"));

    engine::Scene without;
    addBox(without, "probe", kSize, {{"role", "tool"}, {"outcome", {{"min_depth_mm", 2}}}});
    sandbox::SceneRoles none = rolesOf(without);
    CHECK_THROWS_WITH(readOutcome(without, none, none.warnings),
                      Contains("probe") && Contains("min_depth_mm") && Contains("role gauge"));
}

TEST_CASE("gauge: a run reports the deepest and the last reading, and checks the deepest", "[sandbox]") {
    // The cube's lower face, 5 mm below its origin, comes down from 5 mm above the slab, touches it and leaves.
    engine::Scene scene = pressScene();
    addMarked(scene, "face", {{"role", "gauge"}, {"gauge", {{"tip_m", {0, -0.005, 0}}}}},
              {.translation = {0, 0.009, 0}});  // 4 mm above the slab
    json tool = *scene.registry.get<engine::NodeMarking>(scene.nodes[0]).extras;
    tool["touchstone"]["outcome"] = {{"min_depth_mm", 2}, {"max_depth_mm", 2.1}};
    setExtras(scene, scene.nodes[0], tool);
    const sandbox::HapticScene opened = sandbox::openScene(std::move(scene));
    sandbox::HeadlessOptions options;
    options.timing = false;
    const sandbox::Report report = sandbox::runHeadless(opened, opened.settings, options).report;
    CHECK(report.depth.deepest == Approx(4 - opened.settings.contactDistance).margin(1e-6));
    CHECK(report.depth.last == Approx(-1));
    const auto written = toJson(report);
    CHECK(written.at("gauge").at("name") == "face");
    CHECK(written.at("gauge").at("deepest_mm") == report.depth.deepest);
    REQUIRE(report.checks.size() == 2);
    for (const sandbox::OutcomeCheck& check : report.checks) {
        INFO(check.name);
        CHECK(check.value == report.depth.deepest);
        CHECK(check.met == (check.name == "min_depth_mm"));
    }
}

TEST_CASE("outcome: reached requires the goal to be held at some time, seated at the end", "[sandbox]") {
    engine::Scene scene;
    addBox(scene, "probe", kSize, {{"role", "tool"}, {"outcome", {{"reached", true}}}});
    addMarked(scene, "bottom", {{"role", "goal"}, {"goal", {{"tolerance_m", 0.001}, {"hold_s", 0.003}}}});
    sandbox::SceneRoles roles = rolesOf(scene);
    const auto judged = [&](int ticksInside) {
        sandbox::OutcomeJudge judge(readOutcome(scene, roles, roles.warnings));
        TickRecord record;
        for (int tick = 0; tick < 6; ++tick) {
            record.X_WT.p.x() = tick < ticksInside ? 0.5 : 5;
            judge.add(record, 0, 1);
        }
        return judge.checks(true);
    };
    for (const int inside : {0, 2, 3, 6}) {
        const auto checks = judged(inside);
        REQUIRE(checks.size() == 1);
        CHECK(checks[0].name == "reached_hold_s");
        CHECK(checks[0].value == Approx(0.001 * inside));
        CHECK(checks[0].met == (inside >= 3));
    }
    CHECK_THROWS_WITH(
        [&] {
            roles.goal.reset();
            readOutcome(scene, roles, roles.warnings);
        }(),
        Contains("reached") && Contains("role goal"));
}

}  // namespace touchstone::gauge_tests
