// The hard cases: motions of the scenes that break a naive tick, in default mode with the exact solver, each compared
// with its limits. The scenes contain the limits (tools/parts/hard_cases.cpp, with their sources), and `touchstone run`
// also checks them.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "haptics/hands/held_motion.hpp"
#include "haptics/loop/distances.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/loop/tick_driver.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "tests/scenes/scene_files.hpp"

namespace touchstone::hard_tests {

namespace {

sandbox::HapticScene open(const std::string& name, Geometry geometry) {
    return test::openBundled(TOUCHSTONE_BINARY_DIR "/scenes/" + name + ".glb", geometry == Geometry::Spheres);
}

Settings exactAlone(const sandbox::HapticScene& scene, Geometry geometry) {
    Settings settings = sandbox::withGeometry(scene.settings, geometry);
    settings.shadow = kNoSolver;
    return settings;
}

struct Run {
    sandbox::Report report;
    bool finite = true;
    double work = 0;      ///< greatest rows² x iterations of a tick without the last iteration
    double residual = 0;  ///< mm and N by which answers miss their conditions, if the rows are feasible
};

Run run(const sandbox::HapticScene& scene, const std::string& motion, const Settings& settings) {
    Run result;
    sandbox::HeadlessOptions options;
    options.device = "demo:" + motion;
    options.timing = false;
    options.onTick = [&](const TickRecord& record, double) {
        result.finite = result.finite && record.X_WT.isFinite() && record.wrench_C.isFinite() &&
                        record.wrench_o.isFinite() && record.wrench_out.isFinite();
        result.work = std::max(result.work, double(record.rows) * record.rows * (record.iterations - 1));
        if (!(record.flags & kInfeasible))
            result.residual = std::max({result.residual, record.kkt.primal_mm, record.kkt.stationarity_N});
    };
    result.report = sandbox::runHeadless(scene, settings, options).report;
    return result;
}

/// What meshes do not meet of the limits, which were set for sphere trees, but bounds of their own: in the slide of
/// case 1 a vertex slips off an edge, which changes the reference's own force by more (error_split_tests.cpp).
bool isMetByMeshes(const std::string& motion, const sandbox::OutcomeCheck& check) {
    return motion == "hard-01-slide" && check.name == "max_dforce_N_per_ms" && check.value < 0.3;
}

/// Checks that every motion of the scene with this prefix meets its outcome, and that there are `count` of them.
void meetsAll(const sandbox::HapticScene& scene, Geometry geometry, const std::string& prefix, int count = 1) {
    CAPTURE(geometryNames()[std::size_t(geometry)]);
    int found = 0;
    for (const NamedMotion& motion : scene.motions) {
        if (motion.name.rfind(prefix, 0) != 0) continue;
        ++found;
        INFO(motion.name);
        const Run result = run(scene, motion.name, exactAlone(scene, geometry));
        // Between meshes a tool that starts in an obstacle passes through it, which has no limits.
        if (geometry == Geometry::Mesh && result.report.overlapping > 0) {
            CHECK(motion.name == "hard-10-pinch-0.5");
            continue;
        }
        REQUIRE_FALSE(result.report.checks.empty());
        for (const sandbox::OutcomeCheck& check : result.report.checks) {
            INFO(check.name << ": limit " << check.limit << ", was " << check.value);
            CHECK((check.met || (geometry == Geometry::Mesh && isMetByMeshes(motion.name, check))));
        }
        CHECK(result.finite);
        CHECK(result.residual < 1e-6);  // exact to 1e-9 of the desired increment, which is below 100 mm, with a margin
    }
    CHECK(found == count);
}

}  // namespace

TEST_CASE("hard: sliding, deep pressing and fast approach on bunnies (cases 1 to 3)", "[hard][long]") {
    const Geometry geometry = GENERATE(Geometry::Spheres, Geometry::Mesh);
    const sandbox::HapticScene scene = open("bunnies", geometry);
    meetsAll(scene, geometry, "hard-01-slide");
    meetsAll(scene, geometry, "hard-02-deep");
    meetsAll(scene, geometry, "hard-03-approach", 3);
}

TEST_CASE("hard: teleport, rotation, spins, beta past 90 degrees and the wrap at 180 (cases 5 to 8)", "[hard][long]") {
    const Geometry geometry = GENERATE(Geometry::Spheres, Geometry::Mesh);
    const sandbox::HapticScene scene = open("bunnies", geometry);
    meetsAll(scene, geometry, "hard-05-teleport");
    meetsAll(scene, geometry, "hard-06-rotate");
    meetsAll(scene, geometry, "hard-07-spin", 3);
    meetsAll(scene, geometry, "hard-08-beta");
    meetsAll(scene, geometry, "hard-08-wrap");
}

TEST_CASE("hard: a ball at a 1 mm plate, in free flight and off an edge (cases 4, 15 and 16)", "[hard][long]") {
    const Geometry geometry = GENERATE(Geometry::Spheres, Geometry::Mesh);
    const sandbox::HapticScene scene = open("plate", geometry);
    meetsAll(scene, geometry, "hard-04-plate", 4);
    meetsAll(scene, geometry, "hard-15-flight");
    meetsAll(scene, geometry, "hard-16-edge");
}

TEST_CASE("hard: a rod wedged between ears, a ball pinched between walls (cases 9 and 10)", "[hard][long]") {
    const Geometry geometry = GENERATE(Geometry::Spheres, Geometry::Mesh);
    meetsAll(open("wedge", geometry), geometry, "hard-09-wedge");
    meetsAll(open("pinch", geometry), geometry, "hard-10-pinch", 4);
}

TEST_CASE("hard: a start in penetration never gets deeper (case 11)", "[hard][long]") {
    meetsAll(open("bunnies", Geometry::Spheres), Geometry::Spheres, "hard-11-inside", 2);
}

TEST_CASE("hard: the peg enters its hole, with 0.5 mm and with 0.2 mm of clearance (case 12)", "[hard][long]") {
    const Geometry geometry = GENERATE(Geometry::Spheres, Geometry::Mesh);
    const char* name = GENERATE("spline-05", "spline");
    INFO(name);
    meetsAll(open(name, geometry), geometry, "hard-12-peg");
}

TEST_CASE("hard: fits of hundredths of a millimeter, reversed, levered, askew and at random (cases 17 to 20)",
          "[hard][long]") {
    const char* name = GENERATE("spline-002", "spline-001", "peg-h7", "nut");
    INFO(name);
    const sandbox::HapticScene scene = open(name, Geometry::Mesh);
    meetsAll(scene, Geometry::Mesh, "hard-17-reverse");
    meetsAll(scene, Geometry::Mesh, "hard-18-cross", name == std::string("nut"));
    meetsAll(scene, Geometry::Mesh, "hard-19-jam", name == std::string("peg-h7"));
    meetsAll(scene, Geometry::Mesh, "hard-20-walk");
}

TEST_CASE("hard: the force of a static hold is constant, and its noise is that of the encoders (case 13)",
          "[hard][long]") {
    const Geometry geometry = GENERATE(Geometry::Spheres, Geometry::Mesh);
    meetsAll(open("bunnies", geometry), geometry, "hard-13", 2);
}

namespace {

struct Energy {
    double work = 0;  ///< of the wrench on the hand, at the end, mJ
    double gain = 0;  ///< of hand and springs by wrench and damping, at the end, mJ
    double most = 0;  ///< the greatest gain during the motion, mJ
};

/// Case 14: a simulated hand presses, holds, releases and ends clear of contact.
Energy pressed(const sandbox::HapticScene& scene, Geometry geometry, const HandParameters& hand, int delay, double rate,
               double friction = 0) {
    const auto press = std::find_if(scene.motions.begin(), scene.motions.end(),
                                    [](const NamedMotion& m) { return m.name == "hard-14-press"; });
    REQUIRE(press != scene.motions.end());
    Settings settings = exactAlone(scene, geometry);
    settings.rate = rate;
    settings.frictionCoefficient = friction;
    auto device = std::make_unique<HeldMotion>(press->motion, hand, delay);
    const HeldMotion& held = *device;
    TickDriver driver(std::make_unique<Session>(scene.world, settings, std::move(device)));
    Energy energy;
    PenetrationMeter meter(*scene.world);
    double penetration = 0;
    while (!driver.finished()) {
        const TickRecord record = driver.tick();
        penetration = std::max(penetration, meter.depth(record.X_WT, {}, geometry));
        energy.most = std::max(energy.most, held.gain());
    }
    CHECK(penetration <= 1e-3);
    energy.work = held.work();
    energy.gain = held.gain();
    return energy;
}

}  // namespace

TEST_CASE("hard: a simulated hand gains no energy where damping suffices (case 14)", "[hard][long]") {
    const Geometry geometry = GENERATE(Geometry::Spheres, Geometry::Mesh);
    const sandbox::HapticScene scene = open("bunnies", geometry);
    CAPTURE(geometryNames()[std::size_t(geometry)]);
    const int delay = GENERATE(0, 1, 2, 3, 4);
    const double mass = GENERATE(0.05, 0.5), spring = GENERATE(0.2, 1.0);
    // k = 1 N/mm and T = 1 ms give k T = 1 N·s/m. The same holds for torsion, since k_r < k·(45 mm)² and b_r = b·(45
    // mm)².
    const double kT = scene.settings.stiffness * 1, damping = 1.1 * kT * (0.5 + delay);
    CAPTURE(mass, spring, damping, delay);
    const Energy energy = pressed(scene, geometry, HandParameters::fromTranslation(mass, spring, damping), delay, 1000);
    INFO("work " << energy.work << " mJ, gain " << energy.gain << " mJ, on the way at most " << energy.most);
    CHECK(energy.gain <= 1e-9);  // rounding of sums of about 10 mJ
    if (delay <= 1) CHECK(energy.most <= 1);
}

TEST_CASE("hard: friction gives a simulated hand no energy (case 14)", "[hard][long]") {
    const sandbox::HapticScene scene = open("bunnies", Geometry::Mesh);
    const double friction = GENERATE(0.2, 0.9), damping = GENERATE(0.55, 1.65);  // the least with no delay and with one
    CAPTURE(friction, damping);
    const int delay = damping > 1 ? 1 : 0;
    const HandParameters hand = HandParameters::fromTranslation(0.05, 1, damping);
    const Energy with = pressed(scene, Geometry::Mesh, hand, delay, 1000, friction);
    const Energy without = pressed(scene, Geometry::Mesh, hand, delay, 1000);
    INFO("work " << with.work << " mJ, gain " << with.gain << " mJ, on the way at most " << with.most);
    INFO("without friction: work " << without.work << " mJ, gain " << without.gain);
    CHECK(with.gain <= 1e-9);
    CHECK(with.most <= 1);
    CHECK(with.work < without.work);  // friction takes energy
}

TEST_CASE("hard: with too little damping a simulated hand gains energy, unless the rate is ten times higher (case 14)",
          "[hard][long]") {
    const Geometry geometry = GENERATE(Geometry::Spheres, Geometry::Mesh);
    const sandbox::HapticScene scene = open("bunnies", geometry);
    CAPTURE(geometryNames()[std::size_t(geometry)]);
    const HandParameters hand = HandParameters::fromTranslation(0.1, 1, 0.5);
    const Energy slow = pressed(scene, geometry, hand, 1, 1000), fast = pressed(scene, geometry, hand, 1, 10000);
    INFO("1 kHz: work " << slow.work << ", gain " << slow.gain << ", at most " << slow.most);
    INFO("10 kHz: work " << fast.work << ", gain " << fast.gain << ", at most " << fast.most);
    CHECK(slow.most > 1);  // so that the case above can fail
    CHECK(slow.work > 10);
    CHECK(fast.gain <= 1e-9);
    CHECK(fast.most <= 1);
}

TEST_CASE("hard: paper mode runs cases 1 and 6 to their end within its bounds", "[hard][long]") {
    const sandbox::HapticScene scene = open("bunnies", Geometry::Spheres);
    const char* motion = GENERATE("hard-01-slide", "hard-06-rotate");
    INFO(motion);
    Settings settings = sandbox::withMode(scene.settings, Mode::Paper);
    settings.rate =
        250;  // the motion of a second and its approach in some 300 ticks: at 1 kHz they would take a minute
    const Run result = run(scene, motion, settings);
    CHECK(result.finite);
    CHECK(result.report.ticks > 300);
    CHECK(result.report.rows.max.value() <= settings.paperRows);
    CHECK(result.report.pairs.max.value() > settings.paperRows);  // a hard case has more pairs than the mode keeps
    CHECK(result.work <= double(settings.paperWork));
    // Paper mode has no limits of penetration, hover or force.
}

}  // namespace touchstone::hard_tests
