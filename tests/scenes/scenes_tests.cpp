// Runs every scene of the build unchanged.
#include <catch2/catch.hpp>

#include "engine/scene/gltf_write.hpp"
#include "haptics/loop/distances.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "tests/scenes/scene_files.hpp"
#include "tests/support/scene_judge.hpp"
#include "tests/support/temp_folder.hpp"
#include "tools/parts/export_faults.hpp"
#include "tools/parts/scenes.hpp"

namespace touchstone::scenes_tests {

using namespace touchstone::test;
namespace fs = std::filesystem;

namespace {

sandbox::HeadlessOptions untimed() {
    sandbox::HeadlessOptions options;
    options.timing = false;
    return options;
}

/// Scenes whose parts are tried as other programs export them. The nut takes minutes, the others are no fits.
constexpr const char* kExported[] = {"bayonet", "gears", "hook", "lock", "peg", "spline"};

void checkOutcome(const sandbox::Report& report) {
    for (const sandbox::OutcomeCheck& check : report.checks) {
        INFO(check.name << ": limit " << check.limit << ", was " << check.value);
        CHECK(check.met);
    }
    CHECK(report.penetration.max.value() == 0);
    CHECK(report.overlapping == 0);
    CHECK(report.infeasible == 0);
    CHECK(report.rowsTruncated == 0);
}

/// Runs the demonstration as users do, before the exact judge in every n-th tick.
void meetsOutcome(const fs::path& file, unsigned every) {
    INFO(file.stem());
    const sandbox::HapticScene scene = openBundled(file);
    REQUIRE(scene.world->hasMeshes(0));
    const SceneJudge judge(scene);
    int overlaps = 0, pressed = 0, seen = 0;
    sandbox::HeadlessOptions options = untimed();
    options.onTick = [&](const TickRecord& record, double) {
        if (record.tick % every == 0) overlaps += judge.overlap(record.X_WT);
        const Vec3 force = record.wrench_C.force;
        if (record.tick % 50 || force.norm() < 0.01) return;
        // The judge is awake: a tool that is pressed 0.02 mm deeper, or turned by 1 mrad, overlaps.
        ++pressed;
        const Pose deeper{record.X_WT.p - 0.02 * force.normalized(), record.X_WT.q};
        const Vec3 turn = -0.001 * record.wrench_C.torque.normalized();
        seen += judge.overlap(deeper) || judge.overlap({record.X_WT.p, expRotation(turn) * record.X_WT.q});
    };
    const sandbox::Report report = sandbox::runHeadless(scene, scene.settings, options).report;
    CHECK(overlaps == 0);
    CHECK(pressed > 5);
    CHECK(seen > 0.8 * pressed);
    CHECK(report.safetyTrips == 0);  // a device can render all of it
    checkOutcome(report);
}

}  // namespace

TEST_CASE("scenes: the build contains all of them", "[scenes]") {
    std::vector<std::string> names;
    for (const fs::path& file : sceneFiles()) names.push_back(file.stem());
    for (const char* name :
         {"bayonet", "bunnies", "dental", "dental-inflamed", "drawer", "gears", "hello", "hook", "incline", "lock",
          "nut", "peg-h7", "pinch", "plate", "spline", "spline-001", "spline-002", "spline-05", "wedge"}) {
        INFO(name);
        CHECK(std::find(names.begin(), names.end(), name) != names.end());
    }
}

TEST_CASE("scenes: each opens without a warning, starts without contact, and has demonstration and outcome",
          "[scenes][slow]") {
    for (const fs::path& file : sceneFiles()) {
        INFO(file.stem());
        const sandbox::HapticScene scene = openBundled(file);
        for (const std::string& warning : scene.warnings) CHECK(warning == "");
        REQUIRE(scene.world);
        CHECK(scene.demonstration);
        CHECK_FALSE(scene.outcome.empty());
        CHECK(trueClearance(*scene.world, scene.world->X_WT_start, 1) > 0);
    }
}

TEST_CASE("scenes: between spheres, each meets its expected outcome where sphere trees can", "[scenes][slow][long]") {
    for (const fs::path& file : sceneFiles()) {
        INFO(file.stem());
        const sandbox::HapticScene scene = openBundled(file, true);
        const Settings settings = sandbox::withGeometry(scene.settings, Geometry::Spheres);
        // The leaves of closer fits are too thick for the parts to go together.
        const bool closer = scene.roles.clearance && *scene.roles.clearance < 0.1;
        sandbox::HeadlessOptions options = untimed();
        bool finite = true;
        options.onTick = [&](const TickRecord& record, double) {
            finite = finite && record.X_WT.isFinite() && record.wrench_C.isFinite() && record.wrench_out.isFinite();
        };
        const sandbox::Report report = sandbox::runHeadless(scene, settings, options).report;
        CHECK(finite);
        CHECK(report.infeasible == 0);
        if (closer) CHECK_FALSE(report.met());
        if (closer) continue;
        for (const sandbox::OutcomeCheck& check : report.checks) {
            INFO(check.name << ": limit " << check.limit << ", was " << check.value);
            CHECK(check.met);
        }
        CHECK(report.penetration.max.value() <= 0.001);  // 1 µm, of the true gaps
        CHECK(report.rowsTruncated == 0);
    }
}

TEST_CASE("scenes: one of each kind but the nut meets its expected outcome, and in no tenth tick do triangles overlap",
          "[scenes][slow]") {
    // The turns of the nut take a minute; the other splines are the widest and the closest with clearances between.
    const std::vector<std::string> left{"nut", "spline-002", "spline-01", "spline-05"};
    for (const fs::path& file : sceneFiles())
        if (std::find(left.begin(), left.end(), file.stem()) == left.end()) meetsOutcome(file, 10);
}

TEST_CASE("scenes: each meets its expected outcome, and in no tick do triangles overlap", "[scenes][slow][long]") {
    for (const fs::path& file : sceneFiles()) meetsOutcome(file, 1);
}

TEST_CASE("scenes: with the faults of other programs' exports each still meets its expected outcome",
          "[scenes][slow][long]") {
    const TempFolder folder;
    for (const app::SceneInfo& scene : app::sceneTable()) {
        const std::string name(scene.name);
        if (std::find(std::begin(kExported), std::end(kExported), name) == std::end(kExported)) continue;
        engine::Scene made = scene.make({});
        app::addFaults(made, app::kUsualFaults);
        const fs::path file = folder.path() / (name + ".glb");
        engine::writeGltf(made, file);
        INFO(name);
        const sandbox::HapticScene opened = openBundled(file);
        REQUIRE(opened.world->hasMeshes(0));
        CHECK_FALSE(reshapedSentences(opened).empty());
        checkOutcome(sandbox::runHeadless(opened, opened.settings, untimed()).report);
    }
}

TEST_CASE("scenes: a clock and the list worker change no bit of a run", "[scenes][slow][long]") {
    for (const char* name : {"bunnies", "spline", "gears"}) {
        INFO(name);
        const sandbox::HapticScene scene = openBundled(TOUCHSTONE_BINARY_DIR "/scenes/" + std::string(name) + ".glb");
        sandbox::HeadlessOptions options = untimed();
        options.seconds = 3;
        const sandbox::Report report = sandbox::runHeadless(scene, scene.settings, options).report;
        CHECK(report.force > 0.5);
        options.paced = true;
        const sandbox::TimedRun paced = sandbox::timeHeadless(scene, scene.settings, options);
        CHECK(paced.hash == report.hash);
        CHECK(
            std::any_of(paced.ticks.begin(), paced.ticks.end(), [](const auto& tick) { return tick.listWorker > 0; }));
    }
}

TEST_CASE("scenes: paper mode runs each within its row limit", "[scenes][slow][long]") {
    for (const fs::path& file : sceneFiles()) {
        INFO(file.stem());
        const sandbox::HapticScene scene = openBundled(file, true);
        sandbox::HeadlessOptions options = untimed();
        options.seconds = 1.2;  // into contact, in 300 ticks
        bool finite = true;
        options.onTick = [&](const TickRecord& record, double) {
            finite = finite && record.X_WT.isFinite() && record.wrench_C.isFinite();
        };
        Settings settings = sandbox::withMode(scene.settings, Mode::Paper);
        settings.rate = 250;
        const sandbox::Report report = sandbox::runHeadless(scene, settings, options).report;
        CHECK(report.ticks == 300);
        CHECK(report.rows.max.value() <= settings.paperRows);
        CHECK(finite);
    }
}

}  // namespace touchstone::scenes_tests
