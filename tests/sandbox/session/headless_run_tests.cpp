#include <catch2/catch.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "haptics/device/safety.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "tests/support/scene_maker.hpp"

namespace touchstone::headless_run_tests {

using namespace touchstone::test;

namespace {

const sandbox::HapticScene& pressed() {
    static const sandbox::HapticScene scene =
        sandbox::openScene(pressScene(), {.treeCache = {}, .progress = {}, .allTrees = true});
    return scene;
}

const sandbox::HeadlessOptions kUntimed{.device = "demo", .seconds = {}, .timing = false, .onTick = {}};

}  // namespace

TEST_CASE("headless run: a press ends with its motion, carries force, and meets its outcome", "[sandbox]") {
    std::vector<double> forces;
    sandbox::HeadlessOptions options;
    options.onTick = [&](const TickRecord& record, double penetration) {
        CHECK(record.tick == forces.size());
        CHECK(penetration >= 0);
        forces.push_back(record.wrench_C.force.norm());
    };
    const sandbox::HeadlessRun run = sandbox::runHeadless(pressed(), pressed().settings, options);
    CHECK(run.report.ticks == 801);  // n / 1000 s for n = 0 to 800
    CHECK(forces.size() == 801);
    CHECK(run.report.met());
    CHECK(run.report.checks.size() == 4);
    CHECK(run.report.penetration.max.value() <= 0.001);
    // It is pushed 2 mm into the slab, less the distance that is kept, at 1 N/mm.
    CHECK(run.report.force == Approx(2 + pressed().settings.contactDistance).margin(1e-5));
    CHECK(run.report.force == *std::max_element(forces.begin(), forces.end()));
    CHECK(run.report.stepUs.max.value() > 0);
    CHECK(run.report.stepUs.p50.value() >= run.report.solveUs.p50.value());
    CHECK(run.report.shadow == "pqp");
    CHECK(run.report.shadowUs.max.value() > 0);
    CHECK(run.report.shadowForceError.max);
    CHECK_FALSE(run.report.overruns);
    CHECK(run.last.tick == 800);
}

TEST_CASE("headless run: its strongest tick is the one with the greatest force that the safety stage did not limit",
          "[sandbox]") {
    std::vector<TickRecord> ticks;
    sandbox::HeadlessOptions options = kUntimed;
    options.onTick = [&](const TickRecord& record, double) { ticks.push_back(record); };
    const auto check = [&](const Settings& settings, bool limited) {
        ticks.clear();
        const sandbox::HeadlessRun run = sandbox::runHeadless(pressed(), settings, options);
        REQUIRE(run.strongest);
        const TickRecord& strongest = run.strongest->record;
        REQUIRE(run.strongest->ticks == strongest.tick + 1);
        CHECK(ticks[strongest.tick].X_WT == strongest.X_WT);
        CHECK((run.strongest->settings == settings));
        CHECK((strongest.trips != 0) == limited);
        for (const TickRecord& tick : ticks)
            if (limited || tick.trips == 0) CHECK(tick.wrench_C.force.norm() <= strongest.wrench_C.force.norm());
        return run.report.safetyTrips;
    };
    CHECK(check(pressed().settings, false) == 0);
    // 40 N of which the device gives 22: the strongest tick comes before the limit.
    Settings stiff = pressed().settings;
    stiff.stiffness = 20;
    CHECK(check(stiff, false) > 0);

    options.seconds = 0.05;
    CHECK_FALSE(sandbox::runHeadless(pressed(), pressed().settings, options).strongest);  // nothing is touched yet
}

TEST_CASE("headless run: a late tick switches off the force of a hand, and no result that is repeated", "[sandbox]") {
    // With a person, by the arm that no program has answered for; paced or not, by a motion.
    struct {
        const char* device;
        bool paced, live;
    } const cases[]{{"lab:5993", false, true}, {"lab:5993", true, true}, {"demo", false, false}, {"demo", true, false}};
    const auto late = [](const TickRecord& record) { return record.trips >> int(Trip::LateTick) & 1; };
    for (const auto& [device, paced, live] : cases) {
        INFO(device << (paced ? ", paced" : ""));
        sandbox::HeadlessOptions options;
        options.device = device;
        options.seconds = 0.2;
        options.paced = paced;
        int lateTicks = 0;
        options.onTick = [&](const TickRecord& record, double) {
            CHECK(late(record) == (record.periodUs > 1e3 * SafetyStage::kLatePeriods));
            CHECK((!late(record) || record.wrench_out.isZero()));
            lateTicks += late(record);
            if (record.tick == 50) std::this_thread::sleep_for(std::chrono::milliseconds(30));
            if (record.tick == 51) CHECK(late(record) == live);
            if (record.tick > 1) CHECK((record.periodUs > 0) == live);
        };
        const sandbox::HeadlessRun run = sandbox::runHeadless(pressed(), pressed().settings, options);
        CHECK(run.report.ticks == 200);
        CHECK((lateTicks > 0) == live);
    }
}

TEST_CASE("headless run: the friction of the materials is felt, reported, and can be switched off", "[sandbox]") {
    engine::Scene rough = pressScene();
    for (const engine::Entity node : rough.nodes) {
        nlohmann::json& mark = (*rough.registry.get<engine::NodeMarking>(node).extras)["touchstone"];
        mark["staticFriction"] = 0.5;
        mark["dynamicFriction"] = 0.3;
        mark["frictionCombine"] = "maximum";
        mark.erase("outcome");
    }
    const sandbox::HapticScene scene =
        sandbox::openScene(std::move(rough), {.treeCache = {}, .progress = {}, .allTrees = true});
    CHECK(scene.world->friction(0) == Friction{0.5, 0.3});
    Settings settings = scene.settings;
    const sandbox::Report report = sandbox::runHeadless(scene, settings, kUntimed).report;
    // Pushed in by 2 mm at 1 N/mm, and 4 mm to the side.
    const double normal = 2 + settings.contactDistance;
    CHECK(report.friction.force <= 0.5 * normal * (1 + 1e-6));
    CHECK(report.friction.force > 0.49 * normal);
    CHECK(report.friction.sticking > 50);
    CHECK(report.friction.sliding > 200);
    CHECK(report.friction.held == 0);
    CHECK(report.friction.coulomb.worst_N() < 1e-6);
    CHECK(report.friction.coulomb.dissipation_mJ == Approx(0.3 * normal * (4 - 0.3 * normal)).epsilon(0.1));
    CHECK(sandbox::toJson(report).contains("friction"));

    settings.friction = false;
    const sandbox::Report off = sandbox::runHeadless(scene, settings, kUntimed).report;
    CHECK(off.hash == sandbox::runHeadless(pressed(), pressed().settings, kUntimed).report.hash);
    CHECK_FALSE(sandbox::toJson(off).contains("friction"));
}

TEST_CASE("headless run: bit-reproducible, with or without timing or shadow, at any tolerance of the shadow",
          "[sandbox]") {
    const auto hashOf = [](const Settings& settings, bool timing) {
        sandbox::HeadlessOptions options;
        options.timing = timing;
        return sandbox::runHeadless(pressed(), settings, options).report.hash;
    };
    Settings settings = sandbox::withGeometry(pressed().settings, GENERATE(Geometry::Spheres, Geometry::Mesh));
    const std::uint64_t hash = hashOf(settings, true);
    CHECK(hashOf(settings, true) == hash);
    CHECK(hashOf(settings, false) == hash);
    settings.shadow = kNoSolver;
    CHECK(hashOf(settings, false) == hash);
    settings.shadow = "pqp";
    settings.tolerance = 1;
    CHECK(hashOf(settings, false) == hash);
    settings.stiffness = 0.9;
    CHECK(hashOf(settings, false) != hash);
}

TEST_CASE("headless run: another scene object from the same data gives the same bits", "[sandbox]") {
    const sandbox::HapticScene again = sandbox::openScene(pressScene());
    CHECK(sandbox::runHeadless(again, again.settings, kUntimed).report.hash ==
          sandbox::runHeadless(pressed(), pressed().settings, kUntimed).report.hash);
}

TEST_CASE("headless run: --seconds shortens or extends a run, and a short one skips the checks of the end",
          "[sandbox]") {
    sandbox::HeadlessOptions options = kUntimed;
    options.seconds = 0.05;
    sandbox::HeadlessRun run = sandbox::runHeadless(pressed(), pressed().settings, options);
    CHECK(run.report.ticks == 50);
    CHECK(run.report.force == 0);  // still in the air
    REQUIRE(run.report.checks.size() == 1);
    CHECK(run.report.checks[0].name == "max_penetration_mm");
    options.seconds = 1;
    run = sandbox::runHeadless(pressed(), pressed().settings, options);
    CHECK(run.report.ticks == 1000);
    CHECK(run.report.checks.size() == 4);
}

TEST_CASE("headless run: the rate sets the number of ticks of a motion", "[sandbox]") {
    Settings settings = pressed().settings;
    settings.rate = 500;
    CHECK(sandbox::runHeadless(pressed(), settings, kUntimed).report.ticks == 401);
}

TEST_CASE("headless run: without timing there are no times", "[sandbox]") {
    const sandbox::Report report = sandbox::runHeadless(pressed(), pressed().settings, kUntimed).report;
    CHECK_FALSE(report.stepUs.max);
    CHECK(report.shadowUs.max == 0.0);
}

TEST_CASE("headless run: paper mode runs the same scene with the paper's solver", "[sandbox]") {
    Settings settings = pressed().settings;
    settings.mode = Mode::Paper;
    settings.solver = "pqp";
    settings.shadow = kNoSolver;
    sandbox::HeadlessOptions options = kUntimed;
    options.seconds = 0.3;
    const sandbox::Report report = sandbox::runHeadless(pressed(), settings, options).report;
    CHECK(report.mode == "paper");
    CHECK(report.ticks == 300);
    CHECK(report.rows.max.value() <= 1024);
    CHECK(std::isfinite(report.force));
}

TEST_CASE("headless run: a replayed motion is another device", "[sandbox]") {
    const TempFolder folder;
    std::vector<MotionKey> keys;
    for (int i = 0; i <= 20; ++i) keys.push_back({10.0 * i, pressed().demonstration->at(10.0 * i)});
    writeMotion(folder.path() / "hand.csv", keys);
    sandbox::HeadlessOptions options = kUntimed;
    options.device = "replay:" + (folder.path() / "hand.csv").string();
    const sandbox::Report report = sandbox::runHeadless(pressed(), pressed().settings, options).report;
    CHECK(report.ticks == 201);
    CHECK(report.checks.size() == 1);  // the outcome applies only to the demonstration
}

TEST_CASE("headless run: says how much of it is done, and the whole where it is known", "[sandbox]") {
    const TempFolder folder;
    struct {
        std::string device;
        std::optional<double> seconds, whole;
    } const runs[]{{"demo", {}, 0.8},  {"demo", 0.3, 0.3},
                   {"rest", 0.2, 0.2}, {"hand", 0.2, 0.2},
                   {"hand", {}, 0.8},  {"replay:" + (folder.path() / "recording").string(), {}, 0.2}};
    for (const auto& [device, seconds, whole] : runs)
        for (const char* way : {"untimed", "timed", "paced"}) {
            if (std::string(way) == "paced" && (device.starts_with("replay") || !seconds)) continue;
            INFO(device << " " << way << " " << seconds.value_or(0));
            sandbox::HeadlessOptions options;
            options.device = device;
            options.seconds = seconds;
            options.timing = std::string(way) != "untimed";
            options.paced = std::string(way) == "paced";
            if (device == "hand" && seconds && !options.timing) options.record = folder.path() / "recording";
            double last = 0;
            bool grows = true;
            options.onProgress = [&](double done, const std::optional<double>& all) {
                grows &= done >= last && all == whole;
                last = done;
            };
            const sandbox::Report report = sandbox::runHeadless(pressed(), pressed().settings, options).report;
            CHECK(grows);
            CHECK(last == Approx(static_cast<double>(report.ticks) / 1000));
        }
}

}  // namespace touchstone::headless_run_tests
