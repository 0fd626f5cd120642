// Default mode on every bundled motion, before exact judges.
#include <catch2/catch.hpp>

#include "haptics/loop/tick_driver.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "tests/scenes/scene_files.hpp"
#include "tests/support/feet_judge.hpp"
#include "tests/support/scene_judge.hpp"

namespace touchstone::default_mode_tests {

using namespace touchstone::test;

namespace {

/// Follows the motions of a scene whose names begin with the prefix, before the judges in every n-th tick. Coulomb's
/// law is checked in every tick. mu: of every pair; 0: the materials'.
void nothingOverlaps(const std::filesystem::path& file, const std::string& prefix, unsigned every, double mu = 0) {
    CAPTURE(file.stem());
    const sandbox::HapticScene scene = openBundled(file);
    REQUIRE(scene.world);
    const SceneJudge judge(scene);
    const FeetJudge feet(*scene.world);
    Settings settings = sandbox::withGeometry(scene.settings, Geometry::Mesh);
    settings.shadow = kNoSolver;
    settings.frictionCoefficient = mu;
    for (const NamedMotion& motion : scene.motions) {
        if (!motion.name.starts_with(prefix)) continue;
        CAPTURE(motion.name);
        TickDriver driver(
            std::make_unique<Session>(scene.world, settings, std::make_unique<MotionDevice>(motion.motion)));
        const TickState& state = driver.session().state;
        int overlaps = 0, missed = 0, inexact = 0;
        while (!driver.finished()) {
            const TickRecord record = driver.tick();
            inexact += !(record.flags & (kFrictionSoft | kFrictionHeld)) && !record.coulomb.isExact();
            if (record.tick % every != 0) continue;
            if (!(record.flags & kOverlapping)) overlaps += judge.overlap(record.X_WT, state.obstacles());
            if (!(record.flags & (kCapped | kUnfinished))) missed += feet.worst(record, state).beyond > 0;
        }
        CHECK(overlaps == 0);
        CHECK(missed == 0);
        CHECK(inexact == 0);
    }
}

}  // namespace

TEST_CASE("default mode: nothing overlaps where a shaft, gears and a lock go together", "[scenes]") {
    for (const char* name : {"spline", "gears", "lock"})
        nothingOverlaps(TOUCHSTONE_BINARY_DIR "/scenes/" + std::string(name) + ".glb", "demonstration", 10);
}

TEST_CASE("default mode: nothing overlaps in any bundled motion, and what carries the tool is there",
          "[scenes][long]") {
    for (const auto& file : sceneFiles()) nothingOverlaps(file, "", 20);
}

TEST_CASE("default mode: nothing overlaps with friction on every pair, and the forces obey its law", "[scenes][long]") {
    for (const auto& file : sceneFiles()) nothingOverlaps(file, "", 20, 0.3);
}

}  // namespace touchstone::default_mode_tests
