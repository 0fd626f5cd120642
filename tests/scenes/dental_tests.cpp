// The probing depth that a run shows against that of the generated pocket.
#include <catch2/catch.hpp>

#include <cmath>

#include "haptics/sandbox/session/headless_run.hpp"

namespace touchstone::dental_tests {

TEST_CASE("dental: the probe reads the depth of the pocket", "[scenes][slow]") {
    struct Pocket {
        const char* scene;
        double depth;  // mm, as scenes/CMakeLists.txt asks for it
    };
    for (const Pocket& pocket : {Pocket{"dental", 2}, Pocket{"dental-inflamed", 5.5}}) {
        INFO(pocket.scene);
        const sandbox::HapticScene scene =
            sandbox::openScene(TOUCHSTONE_BINARY_DIR "/scenes/" + std::string(pocket.scene) + ".glb",
                               {.treeCache = TOUCHSTONE_BINARY_DIR "/trees", .progress = {}});
        REQUIRE(scene.world);
        sandbox::HeadlessOptions options;
        options.timing = false;
        const sandbox::Report report = sandbox::runHeadless(scene, scene.settings, options).report;
        CHECK(report.gauge == "probing depth");
        // Trees cover their surfaces, so that the tip stops before the bottom by what their leaves stand out; it leans
        // by less than 8°, so that of its ball of 0.25 mm another point than that on the axis touches first.
        double out = scene.world->tool->certificate.protrusion;
        for (const Obstacle& obstacle : scene.world->obstacles)
            if (obstacle.name == "gum") out += obstacle.tree->certificate.protrusion;
        CHECK(out <= 0.03);
        CHECK(report.depth.deepest <= pocket.depth + 0.001);
        CHECK(report.depth.deepest >= pocket.depth - out - 0.25 * (1 - std::cos(8 * 3.14159 / 180)));
    }
}

}  // namespace touchstone::dental_tests
