// The motions of the published experiments agree with their figures.
#include <catch2/catch.hpp>

#include "haptics/loop/setting_table.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "tests/scenes/scene_files.hpp"

namespace touchstone::paper_tests {

namespace {

std::vector<TickRecord> ticksOf(const char* name, const char* motion, Mode mode,
                                Geometry geometry = Geometry::Spheres) {
    const sandbox::HapticScene scene =
        test::openBundled(std::string(TOUCHSTONE_BINARY_DIR "/scenes/") + name + ".glb", geometry == Geometry::Spheres);
    Settings settings = sandbox::withGeometry(sandbox::withMode(scene.settings, mode), geometry);
    settings.solver = kExactSolver;
    settings.shadow = kNoSolver;
    sandbox::HeadlessOptions options;
    options.device = std::string("demo:") + motion;
    options.timing = false;
    std::vector<TickRecord> ticks;
    options.onTick = [&](const TickRecord& record, double penetration) {
        ticks.push_back(record);
        if (mode == Mode::Default) REQUIRE(penetration <= 1e-3);
    };
    sandbox::runHeadless(scene, settings, options);
    return ticks;
}

}  // namespace

TEST_CASE("paper: figure 5 has 50 to 200 pairs, and the deeper motion up to 1000", "[hard]") {
    const auto [motion, fewest, most] =
        GENERATE(std::tuple("figure-5", 50, 200), std::tuple("figure-5-deeper", 200, 1000));
    const std::vector<TickRecord> ticks = ticksOf("bunnies", motion, Mode::Paper);
    int largest = 0;
    for (const TickRecord& tick : ticks) {
        largest = std::max(largest, tick.pairs);
        // The slide lasts from 250 to 4250 ms; its pairs appear and vanish within 400 ms at both ends.
        if (tick.tick >= 650 && tick.tick < 3850) CHECK(tick.pairs >= 0.97 * fewest);
    }
    CHECK(largest <= 1.03 * most);
    CHECK(largest >= 0.97 * most);
}

namespace {

void pushesShaftHome(Geometry geometry) {
    const std::vector<TickRecord> ticks = ticksOf("spline-05", "figure-7", Mode::Default, geometry);
    const auto axial = [&](std::size_t tick) { return ticks.at(tick).wrench_C.force.y(); };
    // Pressed 0.5 mm deep, plus the protrusion of the leaves or the distance that meshes keep; then turning.
    CHECK(axial(850) > 0.5);
    CHECK(axial(1000) > 0.5);
    CHECK(std::abs(axial(2550)) < 0.05);
    CHECK(ticks.back().X_WT.p.y() == Approx(20 - 35).margin(0.01));  // its center, 35 mm deep
}

}  // namespace

TEST_CASE("paper: the shaft of figure 7 rests on the face, turns until it drops, and is pushed home", "[hard]") {
    pushesShaftHome(Geometry::Mesh);
}

TEST_CASE("paper: so it does between the spheres of the paper", "[hard][long]") { pushesShaftHome(Geometry::Spheres); }

}  // namespace touchstone::paper_tests
