// Whether the tool fits is measured, and told with its cause and the settings to take.
#include <catch2/catch.hpp>

#include "haptics/sandbox/measure/fit_check.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "tests/scenes/scene_files.hpp"
#include "tools/parts/close_fits.hpp"
#include "tools/parts/peg.hpp"

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
    checkClearance("spline", 0.2, 1e-3);
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
    coarse.leaves = 512;
    Settings spheres;
    SceneOptions options;
    options.adjust = [&](const Settings& settings) {
        spheres = settings;
        spheres.geometry = Geometry::Spheres;
        spheres.shadow = -1;
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
    const HeadlessRun seated = runHeadless(leaves, mended, untimed);
    CHECK(stuckSentence(leaves, seated.last, mended).empty());
}

TEST_CASE("fit: without a goal the demonstration is measured, and without both that is refused", "[scenes]") {
    const HapticScene pinch = bundled("pinch");
    const FitCheck fit = fitOf(pinch);
    CHECK_FALSE(fit.goal);
    CHECK(fit.rooms.size() > 5);
    CHECK_THAT(fit.verdict, Contains("passes with") || Contains("there is room"));

    engine::Scene scene = app::makePeg(pegOptions(0.01));
    scene.animations.clear();
    const HapticScene still = openScene(std::move(scene));
    CHECK(fitOf(still).goal);
    HapticScene aimless = openScene(app::makePeg(pegOptions(0.01)));
    aimless.roles.goal.reset();
    aimless.demonstration.reset();
    CHECK_THROWS_WITH(fitQuestion(aimless), Contains("nothing says where the tool should fit"));
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
