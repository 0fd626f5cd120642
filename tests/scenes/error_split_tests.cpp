// The error of ticks on the bunnies against their meshes, split by cause.
#include "haptics/system/error_split.hpp"

#include <catch2/catch.hpp>

#include "haptics/system/headless_run.hpp"

using namespace touchstone;

namespace {

system::HapticScene openBunnies() {
    return system::openScene(TOUCHSTONE_BINARY_DIR "/scenes/bunnies.glb",
                             {.treeCache = TOUCHSTONE_BINARY_DIR "/trees", .progress = {}});
}

/// A tick of case 1, and the one before it.
std::pair<TickRecord, TickRecord> slideTo(const system::HapticScene& scene, const Settings& settings, double seconds) {
    TickRecord before, now;
    system::HeadlessOptions options;
    options.device = "demo:hard-01-slide";
    options.timing = false;
    options.seconds = seconds;
    options.onTick = [&](const TickRecord& record, double) {
        before = now;
        now = record;
    };
    system::runHeadless(scene, settings, options);
    return {before, now};
}

}  // namespace

TEST_CASE("error split: sliding bunnies are off by what their spheres stand out, not by how they are solved",
          "[reference]") {
    const system::HapticScene scene = openBunnies();
    const MeshReference reference = system::meshReferenceOf(scene);
    Settings settings = scene.settings;
    settings.shadow = -1;
    const double seconds = GENERATE(0.3, 0.5, 0.9);
    INFO("at " << seconds << " s");
    const auto [before, now] = slideTo(scene, settings, seconds);
    REQUIRE(now.wrench_C.force.norm() > 0.5);
    const system::ErrorSplit split = system::splitError(*scene.world, settings, reference, before, now);
    WARN("clearance of the answer's meshes "
         << reference.clearance(now.X_WT, 2) << " contacts " << split.truth.contacts << " iterations "
         << split.truth.iterations << " residual " << split.truth.residual << " total " << split.total.position
         << " mm " << split.total.rotation << " rad " << split.total.force << " N " << split.total.torque
         << " mNm; geometry " << split.geometry.force << " N " << split.geometry.torque << " lin "
         << split.linearisation.force << " N " << split.linearisation.torque << " solver " << split.solver.force
         << " conv " << split.converged);
}
