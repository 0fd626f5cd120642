// Whether the tool fits is measured, and told with its cause and the settings to take.
#include <catch2/catch.hpp>

#include "haptics/loop/distances.hpp"
#include "haptics/sandbox/measure/fit_check.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "tests/scenes/scene_files.hpp"
#include "tests/support/scene_maker.hpp"
#include "tools/parts/angles.hpp"
#include "tools/parts/close_fits.hpp"
#include "tools/parts/nut.hpp"
#include "tools/parts/peg.hpp"
#include "tools/parts/shapes.hpp"
#include "tools/parts/solid.hpp"

namespace touchstone::fit_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;
using Catch::Matchers::Contains;

namespace {

FitCheck fitOf(const HapticScene& scene, const Settings& settings) { return *checkFit(fitQuestion(scene), settings); }
FitCheck fitOf(const HapticScene& scene) { return fitOf(scene, scene.settings); }

HapticScene bundled(const char* name) {
    return openBundled(TOUCHSTONE_BINARY_DIR "/scenes/" + std::string(name) + ".glb");
}

app::SceneOptions pegOptions(double clearance) {
    app::SceneOptions options;
    options.peg.clearance = clearance;
    return options;
}

/// A peg that is thicker than its hole by twice this, mm.
HapticScene tightPeg(double overlap) {
    app::SceneOptions options = pegOptions(0.01);
    options.peg.segments = 90;
    engine::Scene scene = app::makePeg(options);
    app::PegFit thick = options.peg;
    thick.diameter += 2 * (overlap + options.peg.clearance);
    scene.registry.get<engine::MeshInstance>(scene.nodes.front()).primitives.front().mesh =
        std::make_shared<const engine::MeshData>(app::peg(thick));
    return openScene(std::move(scene));
}

}  // namespace

namespace {

/// Checks the clearance of a bundled scene, mm.
void checkClearance(const char* name, double clearance, double tolerance) {
    INFO(name);
    const HapticScene scene = bundled(name);
    const FitCheck fit = fitOf(scene);
    REQUIRE(fit.goal);
    REQUIRE(fit.least);
    CHECK(std::abs(fit.least->clearance - clearance) < tolerance);
    CHECK(fit.fits());
    CHECK(fit.error == scene.settings.contactDistance);
    CHECK_THAT(fit.verdict, Contains("goes in with"));
    CHECK(fit.advice.empty());
    // It is a clearance: at that pose the meshes are as far apart.
    CHECK(trueClearance(*scene.world, fit.least->X_WT, 1, {}, Geometry::Mesh) ==
          Approx(fit.least->clearance).margin(1e-6));
}

}  // namespace

TEST_CASE("fit: the clearance of fits is measured, whatever limits it at the seat", "[scenes]") {
    checkClearance("peg-h7", 0.01, 1e-4);
    checkClearance("bayonet", 0.29, 1e-2);  // chords take from 0.3
}

TEST_CASE("fit: so is that of splines, threads, gears and locks", "[scenes][long]") {
    checkClearance("spline-001", 0.01, 1e-4);
    checkClearance("nut", 0.049, 2e-3);  // docs/scenes.md: 0.0463 to 0.0496
    checkClearance("gears", 0.29, 1e-2);
    checkClearance("lock", 0.29, 1e-2);
}

TEST_CASE("fit: parts that overlap are told, with how much and where", "[scenes]") {
    const HapticScene scene = tightPeg(0.012);
    const FitCheck fit = fitOf(scene);
    CHECK_FALSE(fit.fits());
    REQUIRE(fit.least);
    CHECK(-fit.least->clearance > 0.004);
    CHECK(-fit.least->clearance < 0.02);
    CHECK_THAT(fit.verdict, Contains("does not go in: the parts overlap by 0.01") && Contains("\"hole\""));
    CHECK(fit.advice.empty());
}

TEST_CASE("fit: a contact distance or sphere trees that take the clearance are told, and mended by the advice",
          "[scenes]") {
    const HapticScene scene = openScene(app::makePeg(pegOptions(0.0015)));
    const FitCheck tight = fitOf(scene);
    CHECK_FALSE(tight.fits());
    CHECK_THAT(tight.verdict, Contains("contacts are kept 0.0020 mm apart in a clearance of 0.0015 mm"));
    REQUIRE(tight.advice.size() == 1);
    Settings mended = scene.settings;
    CHECK(setSetting(mended, tight.advice[0].first, tight.advice[0].second).empty());
    CHECK(fitOf(scene, mended).fits());

    app::SceneOptions coarse = pegOptions(0.3);
    coarse.peg.segments = 60;
    coarse.leaves = 512;
    Settings spheres;
    SceneOptions options;
    options.adjust = [&](const Settings& settings) {
        spheres = settings;
        spheres.geometry = Geometry::Spheres;
        spheres.shadow = kNoSolver;
        return spheres;
    };
    const HapticScene leaves = openScene(app::makePeg(coarse), options);
    const FitCheck out = fitOf(leaves, spheres);
    CHECK(out.spheres);
    CHECK_FALSE(out.fits());
    CHECK_THAT(out.verdict, Contains("sphere trees reach out") && Contains("into a clearance of 0.300 mm"));
    mended = spheres;
    for (const auto& [key, value] : out.advice) CHECK(setSetting(mended, key, value).empty());
    CHECK(fitOf(leaves, mended).fits());

    // The same peg sticks in its demonstration, and the run says so.
    HeadlessOptions untimed;
    untimed.timing = false;
    const HeadlessRun run = runHeadless(leaves, spheres, untimed);
    CHECK_THAT(stuckSentence(leaves, run.last, spheres),
               Contains("above the goal at") && Contains("tilted by") && Contains("sphere trees reach out"));
    TickRecord seated = run.last;
    seated.X_WT = leaves.roles.goal->X_WT;
    CHECK(stuckSentence(leaves, seated, mended).empty());
}

TEST_CASE("fit: without a goal the demonstration is measured, and without both that is refused", "[scenes]") {
    const HapticScene pinch = bundled("pinch");
    const FitCheck fit = fitOf(pinch);
    CHECK_FALSE(fit.goal);
    CHECK(fit.rooms.size() > 5);
    CHECK_THAT(fit.verdict, Contains("passes with") || Contains("has room"));

    engine::Scene scene = app::makePeg(pegOptions(0.01));
    scene.animations.clear();
    const HapticScene still = openScene(std::move(scene));
    CHECK(fitOf(still).goal);
    HapticScene aimless = openScene(app::makePeg(pegOptions(0.01)));
    aimless.roles.goal.reset();
    aimless.demonstration.reset();
    CHECK_THROWS_WITH(fitQuestion(aimless), Contains("nothing says where the tool should fit"));
}

namespace {

/// A part and the hole or bolt that it fits, as they are drawn.
struct Kind {
    const char* name;
    engine::MeshData tool, obstacle;
    double depth, clearance;  ///< mm
    double lead = 0;          ///< mm
    bool seated = true;       ///< the obstacle has a floor at the depth
};

/// A shaft with a flat and its blind hole; both chords and flat are `clearance` apart.
Kind dShaft() {
    constexpr double kRadius = 6, kFlat = 4.5, kDepth = 12, kWall = 4, kClearance = 0.1;
    const auto profile = [&](double outward) {
        app::Outline outline;
        const double angle = std::acos((kFlat + outward) / (kRadius + outward));
        for (int i = 0; i <= 40; ++i) {
            const double at = angle + (app::kTau - 2 * angle) * i / 40;
            outline.push_back((kRadius + outward) * glm::dvec2(std::cos(at), std::sin(at)));
        }
        return outline;
    };
    const app::Outline shaft = profile(0), hole = profile(kClearance), outer = app::polygon(kRadius + kWall, 40);
    app::Solid tool, hub;
    const app::Section sides[] = {{0, shaft}, {20, shaft}};
    addWall(tool, sides, 20);
    addEnd(tool, 20, app::triangulate(shaft, {}, 3), true);
    addEnd(tool, 0, app::triangulate(shaft, {}, 3), false);
    const app::Section outside[] = {{-kDepth - kWall, outer}, {0, outer}}, inside[] = {{0, hole}, {-kDepth, hole}};
    addWall(hub, outside, 20);
    addWall(hub, inside, 20);
    addEnd(hub, 0, app::triangulate(outer, hole, 3), true);
    addEnd(hub, -kDepth, app::triangulate(hole, {}, 3), true);
    addEnd(hub, -kDepth - kWall, app::triangulate(outer, {}, 3), false);
    return {"D shaft", finished(tool), finished(hub), kDepth, kClearance};
}

Kind roundPeg() {
    app::PegFit fit;
    fit.clearance = 0.1;
    fit.segments = 36;
    return {"peg", app::peg(fit), app::pegHole(fit), fit.depth, fit.clearance};
}

Kind toothed() {
    app::SplineFit fit;
    fit.clearance = 0.1;
    fit.spacing = 4;
    return {"toothed shaft", app::splinedShaft(fit), app::splinedHole(fit), fit.depth, fit.clearance};
}

Kind threaded(bool left = false, int starts = 1) {
    app::ThreadFit fit;
    fit.starts = starts;
    fit.clearance = 0.1;
    fit.segments = 48;
    fit.left = left;
    return {"nut", app::nut(fit), app::bolt(fit), fit.standing(), fit.clearance, left ? -fit.lead() : fit.lead(),
            false};
}

/// The tool's goal, mm from its seat along the way out, negative for inside, and rad about that axis.
HapticScene placed(const Kind& kind, double scale, double above, double turn = 0) {
    const auto scaled = [&](engine::MeshData mesh) {
        for (glm::vec3& p : mesh.positions) p *= float(scale);
        return std::make_shared<const engine::MeshData>(std::move(mesh));
    };
    engine::Scene scene;
    const auto add = [&](const char* name, const engine::MeshData& mesh, const engine::LocalTransform& at) {
        const engine::Entity node = addNode(scene, name, {}, at);
        addMesh(scene, node, scaled(mesh));
        setExtras(scene, node, {{"touchstone", {{"role", name}}}});
    };
    const double seat = kind.seated ? -kind.depth * scale : 0;
    add("tool", kind.tool, {.translation = {0, 0.002 * scale * kind.depth, 0}});
    add("obstacle", kind.obstacle, {});
    const glm::dquat turned = glm::angleAxis(turn, glm::dvec3(0, 1, 0));
    const engine::Entity goal =
        addNode(scene, "goal", {}, {.translation = {0, (seat + above) / 1000, 0}, .rotation = turned});
    nlohmann::json region{{"tolerance_m", std::min(1.0, 0.15 * scale) / 1000},
                          {"tolerance_rad", 0.05},
                          {"depth_m", kind.depth * scale / 1000}};
    if (kind.lead != 0) region["lead_m"] = kind.lead * scale / 1000;
    setExtras(scene, goal, {{"touchstone", {{"role", "goal"}, {"goal", region}}}});
    updateWorldTransforms(scene);
    return openScene(std::move(scene));
}

}  // namespace

TEST_CASE("fit: a goal inside its obstacle is named with its depth, in parts of every kind and size",
          "[scenes][long]") {
    const Kind kinds[] = {roundPeg(), dShaft(), toothed()};
    for (const Kind& kind : kinds)
        for (const double scale : {0.3, 1.0, 30.0})
            for (const double above : {-1.27, -0.1, -0.01, 0.0, 0.002}) {
                if (&kind == &kinds[2] && (scale != 1 || above != -0.1)) continue;  // its many faces take long
                if (scale != 1 && above != -1.27 && above != 0.002) continue;
                INFO(kind.name << " times " << scale << ", its goal " << above << " mm above the floor");
                const HapticScene scene = placed(kind, scale, above);
                const FitCheck fit = fitOf(scene);
                INFO(fit.verdict);
                REQUIRE(fit.goal);
                // Coordinates are floats: 2^-24 of 1.5 m at most. Parts that overlap by no more touch.
                CHECK(fit.goal->asPlaced == Approx(std::min(above, fit.goal->asPlaced > 0 ? fit.goal->asPlaced : above))
                                                .margin(2e-3 * scale / 30 + 2e-4));
                // No pose of the answer is farther from the goal than its tolerance, and none overlaps.
                CHECK((fit.goal->X_WT.p - scene.roles.goal->X_WT.p).norm() <= scene.roles.goal->tolerance);
                if (above < -scene.roles.goal->tolerance) {
                    CHECK_FALSE(fit.fits());
                    CHECK_THAT(fit.verdict,
                               Contains("does not go in: the goal lies") && Contains("inside \"obstacle\""));
                    REQUIRE(fit.free.raised);
                    CHECK(*fit.free.raised == Approx(-above).margin(2e-3 * scale / 30 + 2e-4));
                    CHECK_THAT(goalDoubt(*scene.world, *scene.roles.goal), Contains("inside \"obstacle\""));
                } else {
                    CHECK(fit.fits());
                    const double room = kind.clearance * scale;
                    if (room < fitRange(*scene.world)) {
                        REQUIRE(fit.least);
                        CHECK(fit.least->clearance == Approx(room).epsilon(0.06));
                    } else {
                        CHECK_FALSE(fit.least);
                    }
                    CHECK(goalDoubt(*scene.world, *scene.roles.goal).empty());
                }
            }
}

TEST_CASE("fit: a goal in mid-air is named with its distance, and one in reach is not", "[scenes]") {
    const Kind kinds[] = {roundPeg(), dShaft(), toothed(), threaded()};
    for (const Kind& kind : kinds)
        for (const double scale : {0.3, 1.0, 30.0}) {
            INFO(kind.name << " times " << scale);
            const HapticScene above = placed(kind, scale, (31 + kind.depth) * scale);
            const FitCheck fit = fitOf(above);
            INFO(fit.verdict);
            // Straight above the mouth, apart from chamfers that make it wider than the tip by some millimeters.
            CHECK(partGap(*above.world, above.roles.goal->X_WT, 1e30).gap == Approx(31 * scale).epsilon(0.03));
            CHECK_THAT(fit.verdict, Contains("mm from every obstacle: are the parts on one axis?"));
            CHECK_THAT(goalDoubt(*above.world, *above.roles.goal), Contains("are the parts on one axis?"));
            const HapticScene seated = placed(kind, scale, 0.05 * scale);
            CHECK(goalDoubt(*seated.world, *seated.roles.goal).empty());
        }
}

TEST_CASE("fit: a tool that is turned against its hole is told the turn that fits", "[scenes][long]") {
    for (const double turn : {-1.6, 2.5}) {
        INFO("turned by " << turn);
        const FitCheck shaft = fitOf(placed(dShaft(), 1, 0.05, turn));
        CHECK_THAT(shaft.verdict, Contains("does not go in") && Contains("it fits when turned by"));
        REQUIRE(shaft.free.turned);
        CHECK(shaft.free.turned->turn == Approx(-turn).margin(1e-3));  // the flats leave some degrees, evenly
        // Turned against its thread a nut is as much too high or too low. Sections of 7.5° make the play uneven.
        const FitCheck nut = fitOf(placed(threaded(), 1, 0, turn));
        CHECK_THAT(nut.verdict, Contains("does not go in") && Contains("turned by") && Contains("or raised by"));
        REQUIRE(nut.free.turned);
        CHECK(nut.free.turned->turn == Approx(-turn).margin(0.05));
    }
    // No turn helps a peg that is too thick, and that is not claimed.
    const FitCheck thick = fitOf(tightPeg(0.012));
    CHECK_FALSE(thick.free.turned);
    CHECK_FALSE(thick.free.raised);
}

TEST_CASE("fit: parts drawn line to line have no clearance, and do not overlap", "[scenes]") {
    for (const double scale : {0.3, 1.0, 30.0}) {
        INFO("times " << scale);
        Kind kind = roundPeg();
        app::PegFit fit;
        fit.clearance = 0;
        fit.segments = fit.holeSegments = 36;
        fit.diameter *= std::cos(app::kPi / 36);  // the hole is circumscribed
        kind.obstacle = app::pegHole(fit);
        const FitCheck line = fitOf(placed(kind, scale, 0.05));
        CHECK_FALSE(line.fits());
        CHECK_THAT(line.verdict, Contains("sticks: no clearance: contacts are kept 0.0020 mm apart"));
    }
}

TEST_CASE("fit: a tool that cannot go in is told after a few measurements, and a search can be stopped", "[scenes]") {
    // Counts instead of time: of moves out of the overlap, and of places beside it.
    const auto measurements = [](const HapticScene& scene) {
        int count = 0;
        const auto fit = checkFit(fitQuestion(scene), scene.settings, [&](double) { return ++count > 0; });
        REQUIRE(fit);
        CHECK(fit->rooms.size() == 1);  // the rest of the way cannot help
        return count;
    };
    CHECK(measurements(placed(threaded(), 1, 0, 2.5)) < 2500);
    CHECK(measurements(tightPeg(0.012)) < 2500);
    int asked = 0;
    const HapticScene scene = tightPeg(0.012);
    CHECK_FALSE(checkFit(fitQuestion(scene), scene.settings, [&](double) { return ++asked < 20; }));
    CHECK(asked <= 22);
}

TEST_CASE("fit: the phase of a thread is found from any turn, with either hand and any number of starts", "[scenes]") {
    for (const bool left : {false, true})
        for (const int starts : {1, 2, 3})
            for (const double turn : {0.5, -2.0, 3.0}) {
                INFO((left ? "left" : "right") << "-handed, " << starts << " starts, turned by " << turn);
                const HapticScene scene = placed(threaded(left, starts), 1, 0, turn);
                const ThreadPhase phase = threadPhase(*scene.world, *scene.roles.goal);
                CHECK(phase.doubt.empty());
                CHECK(phase.starts == starts);
                CHECK(std::remainder(phase.turn.turn + turn, app::kTau / starts) == Approx(0).margin(0.05));
                if (turn != 0.5) continue;
                GoalRegion goal = *scene.roles.goal;
                const double lead = goal.lead;
                goal.lead = -lead;
                CHECK_THAT(threadPhase(*scene.world, goal).doubt,
                           Contains("the lead of a left-handed thread is negative"));
                // The pitch in place of the lead is the same for one start.
                for (const double wrong : {1.5 * lead, -1.5 * lead, lead / starts})
                    if (wrong != lead) {
                        goal.lead = wrong;
                        CHECK_THAT(threadPhase(*scene.world, goal).doubt, Contains("check the lead"));
                    }
            }
}

TEST_CASE("fit: a tool that is stuck past its goal is told to turn back, by as much as its thread says", "[scenes]") {
    HapticScene scene = openScene(app::makePeg(pegOptions(0.01)));
    GoalRegion& goal = *scene.roles.goal;
    goal.tolerance = 0.1;
    const auto said = [&](double lead, double below, double turn) {
        goal.lead = lead;
        TickRecord last;
        last.X_WT = goal.X_WT * Pose{{0, -below, 0}, expRotation({0, turn, 0})};
        last.wrench_C.force = {0, 3, 0};
        return stuckSentence(scene, last, scene.settings, false);
    };
    for (const double lead : {2.0, -2.0, 4.0, -0.5})
        for (const double turns : {0.75, 1.5, 3.25}) {
            // The nut follows its thread.
            const double below = turns * std::abs(lead), turn = -app::kTau * below / lead;
            INFO("lead " << lead << " mm, " << turns << " turns past the goal");
            char expected[100];
            std::snprintf(expected, sizeof expected, "so turn it back by %.2f rad", app::kTau * turns);
            CHECK_THAT(said(lead, below, turn), Contains("mm past the goal at 3.0 N") && Contains(expected));
            CHECK_THAT(said(lead, -below, -turn), Contains("mm above the goal") && !Contains("turn it back"));
            CHECK_THAT(said(0, below, 0), Contains("mm past the goal") && !Contains("turn it back"));
        }
}

TEST_CASE("fit: a tool counts as stuck when it is pressed and does not move for two seconds", "[scenes]") {
    GoalRegion goal;
    StuckWatch watch;
    TickRecord record;
    record.X_WT.p = Vec3(0, 20, 0);
    record.wrench_C.force = Vec3(0, 3, 0);
    int told = 0;
    for (int ms = 0; ms < 1900; ++ms) told += watch.add(goal, record, ms);
    CHECK(told == 0);
    for (int ms = 1900; ms < 9000; ++ms) told += watch.add(goal, record, ms);
    CHECK(told == 1);
    record.X_WT.p.y() = 10;
    for (int ms = 9000; ms < 12000; ++ms) told += watch.add(goal, record, ms);
    CHECK(told == 2);
    record.X_WT.p.y() = 0;  // at the goal
    for (int ms = 12000; ms < 20000; ++ms) told += watch.add(goal, record, ms);
    CHECK(told == 2);
}

}  // namespace touchstone::fit_tests
