// Compares the probing depth of a run with the depth of the generated pocket.
#include <catch2/catch.hpp>

#include <cmath>

#include "haptics/loop/setting_table.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "tests/scenes/scene_files.hpp"

namespace touchstone::dental_tests {

TEST_CASE("dental: the probe reads the depth of the pocket", "[scenes][slow]") {
    struct Pocket {
        const char* scene;
        double depth;  // mm, as in the table of tools/parts/scenes.cpp
    };
    const Pocket pocket = GENERATE(Pocket{"dental", 2}, Pocket{"dental-inflamed", 5.5});
    INFO(pocket.scene);
    // Between spheres in the deeper one; both meet their outcome so among the long tests.
    const Geometry geometry = pocket.depth > 5 ? GENERATE(Geometry::Spheres, Geometry::Mesh) : Geometry::Mesh;
    CAPTURE(geometryNames()[std::size_t(geometry)]);
    const sandbox::HapticScene scene =
        test::openBundled(TOUCHSTONE_BINARY_DIR "/scenes/" + std::string(pocket.scene) + ".glb", true);
    REQUIRE(scene.world);
    sandbox::HeadlessOptions options;
    options.timing = false;
    const sandbox::Report report =
        sandbox::runHeadless(scene, sandbox::withGeometry(scene.settings, geometry), options).report;
    CHECK(report.gauge == "probing depth");
    // Trees cover their surfaces, so the tip stops above the bottom by the protrusion of the leaves. The probe
    // leans by less than 8°, so its ball of 0.25 mm touches first at a point off the axis.
    double out = scene.settings.contactDistance;
    if (geometry == Geometry::Spheres) {
        out = scene.world->tool.spheres->certificate.protrusion;
        for (const Obstacle& obstacle : scene.world->obstacles)
            if (obstacle.name == "gum") out += obstacle.part.spheres->certificate.protrusion;
    }
    CHECK(out <= 0.03);
    CHECK(report.depth.deepest <= pocket.depth + 0.001);
    CHECK(report.depth.deepest >= pocket.depth - out - 0.25 * (1 - std::cos(8 * 3.14159 / 180)));
}

}  // namespace touchstone::dental_tests
