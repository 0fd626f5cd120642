// A hand that works by feel inserts the splined shaft into its hole, but not into a blocked hole.
#include <catch2/catch.hpp>

#include <unistd.h>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "haptics/sandbox/session/session.hpp"
#include "haptics/sandbox/trials/trial.hpp"
#include "tools/parts/close_fits.hpp"
#include "tools/parts/scene_kit.hpp"

namespace touchstone::trials_tests {

using namespace touchstone::sandbox;
using nlohmann::ordered_json;
namespace fs = std::filesystem;

namespace {

HapticScene open(const std::string& name) {
    return openScene(TOUCHSTONE_BINARY_DIR "/scenes/" + name + ".glb",
                     {.treeCache = TOUCHSTONE_BINARY_DIR "/trees", .progress = {}});
}

Protocol study(const std::string& scene, int hands, double seconds, double friction = 0) {
    return readProtocol(ordered_json{{"format", "touchstone trials"},
                                     {"participants", hands},
                                     {"time_limit_s", seconds},
                                     {"conditions", {{{"scene", scene}, {"friction_coefficient", friction}}}}},
                        "study");
}

std::vector<ordered_json> run(const HapticScene& scene, const Protocol& protocol) {
    const fs::path folder = fs::temp_directory_path() / ("touchstone_trials_" + std::to_string(getpid()));
    std::vector<ordered_json> rows;
    for (const Trial& trial : protocol.trials()) {
        fs::remove_all(folder);
        rows.push_back(runTrial(scene, protocol, trial, folder).value());
    }
    fs::remove_all(folder);
    return rows;
}

/// The scene with a second shaft in the hole, its upper end at this depth below the mouth, mm, and turned, rad.
HapticScene blockedScene(const std::string& name, double depth, double turned) {
    HapticScene scene = open(name);
    World world = *scene.world;
    const GoalRegion& goal = *scene.roles.goal;
    const double length = 2 * (goal.depth + goal.X_WT.p.y());  // the tool's origin is its center
    world.obstacles.push_back({"plug", world.tool, {{0, -depth - length / 2, 0}, expRotation({0, turned, 0})}});
    scene.world = std::make_shared<World>(world);
    return scene;
}

}  // namespace

TEST_CASE("trials: hands of many seeds insert the splined shaft by feel", "[scenes]") {
    const std::string name = GENERATE("spline-05", "spline");
    const HapticScene scene = open(name);
    for (const ordered_json& row : run(scene, study(name, 6, 30))) {
        INFO(name << " " << row);
        CHECK(row.at("outcome") == "seated");
        // In order: approach, search or align, and insertion no faster than a hand moves.
        CHECK(row.at("first_contact_s").get<double>() > 0.2);
        CHECK(row.at("search_s").get<double>() + row.at("align_s").get<double>() > 0.02);
        CHECK(row.at("insert_s").get<double>() > 1);  // 36 mm at about 30 mm/s
        CHECK(row.at("force_peak_N").get<double>() < 6);
        CHECK(row.at("residual_penetration_mm").get<double>() <= 1e-3);
    }
}

/// The hands of a study that were not seated, as text.
std::string failed(const HapticScene& scene, int hands) {
    std::string text;
    for (const ordered_json& row : run(scene, study(scene.scene.name, hands, 30)))
        if (row.at("outcome") != "seated") text += row.dump() + "\n";
    return text;
}

/// A cap that is put over a fixed peg from below: the same parts with the roles exchanged.
engine::Scene makeCap(const app::SceneOptions& options) {
    const app::PegFit& fit = options.peg;
    engine::Scene scene;
    scene.name = "cap";
    const auto add = [&](const char* name, double y, const ordered_json& marking) {
        const engine::Entity node = addNode(scene, name, {}, {.translation = {0, y / 1000, 0}});
        setExtras(scene, node, {{"touchstone", marking}});
        return node;
    };
    addMesh(scene, add("peg", 0, {{"role", "obstacle"}}), app::shared(app::peg(fit)));
    addMesh(scene, add("cap", -15, {{"role", "tool"}}), app::shared(app::pegHole(fit)));
    const ordered_json below = {{"translation", {0, -(fit.depth + 15) / 1000, 0}}};
    add("over the peg", fit.depth,
        {{"role", "goal"}, {"goal", {{"tolerance_m", 2e-4}, {"tolerance_rad", 0.01}, {"fold", 0}, {"way", {below}}}}});
    updateWorldTransforms(scene);
    return scene;
}

/// A scene of the generator that is not bundled.
struct Foreign {
    const char* name;
    void (*choose)(app::SceneOptions&);
    engine::Scene (*make)(const app::SceneOptions&);
};

constexpr Foreign kForeign[] = {
    {"a rectangular peg",
     [](app::SceneOptions& options) {
         options.peg.breadth = 14;
         options.peg.clearance = 0.1;
     },
     app::makePeg},
    {"a square peg without chamfers, 0.05 mm",
     [](app::SceneOptions& options) {
         options.peg.breadth = options.peg.diameter;
         options.peg.clearance = 0.05;
         options.peg.chamfer = 0;
     },
     app::makePeg},
    {"a round peg without chamfers in a thin plate",
     [](app::SceneOptions& options) {
         options.peg.clearance = 0.05;
         options.peg.chamfer = 0;
         options.peg.depth = 12;
         options.peg.through = true;
     },
     app::makePeg},
    {"a cap over a peg", [](app::SceneOptions& options) { options.peg.clearance = 0.1; }, makeCap},
    {"a left-handed M10 nut",
     [](app::SceneOptions& options) {
         options.nut.left = true;
         options.nut.diameter = 10;
         options.nut.pitch = 1.5;
         options.nut.height = 6;
     },
     app::makeNut},
};

HapticScene made(const Foreign& foreign) {
    app::SceneOptions options;
    foreign.choose(options);
    return openScene(foreign.make(options));
}

TEST_CASE("trials: hands assemble what is turned, hung and locked, and what goes through", "[scenes]") {
    for (const char* name : {"bayonet", "lock", "hook", "gears", "peg-h7"}) {
        INFO(name);
        CHECK(failed(open(name), 2) == "");
    }
    for (const Foreign& foreign : std::span(kForeign).first(4)) {
        INFO(foreign.name);
        CHECK(failed(made(foreign), 2) == "");
    }
}

TEST_CASE("trials: of 24 hands at least 23 assemble each scene", "[scenes][long]") {
    constexpr int kHands = 24;
    const auto failures = [](const HapticScene& scene) {
        const std::string text = failed(scene, kHands);
        UNSCOPED_INFO(scene.scene.name << "\n" << text);
        return std::count(text.begin(), text.end(), '\n');
    };
    for (const char* name : {"spline", "peg-h7", "bayonet", "gears", "lock", "hook"}) CHECK(failures(open(name)) <= 1);
    for (const Foreign& foreign : std::span(kForeign).first(4)) {
        INFO(foreign.name);
        CHECK(failures(made(foreign)) <= 1);
    }
    // A nut takes a minute of computing in this build.
    CHECK(failed(open("nut"), 2) == "");
    CHECK(failed(made(kForeign[4]), 1) == "");
}

TEST_CASE("trials: with friction, hands assemble nearly as often as without", "[scenes][long]") {
    const HapticScene scene = open("spline");
    const std::vector<ordered_json> rows = run(scene, study("spline", 48, 30, 0.5));
    for (const ordered_json& row : rows) CHECK(row.at("friction_coefficient") == 0.5);
    // 179 to 184 of 192 hands did with one rounding or another, so that one in a hundred times fewer than 42 of 48 do.
    CHECK(std::count_if(rows.begin(), rows.end(), [](const auto& row) { return row.at("outcome") == "seated"; }) >= 42);
}

TEST_CASE("trials: no hand is seated in a blocked hole", "[scenes]") {
    // Blocked at the mouth, by keys in place of keyways, and 6 mm below the mouth.
    const auto [depth, turned] = GENERATE(std::pair(0.0, 0.3927), std::pair(6.0, 0.0));
    const HapticScene scene = blockedScene("spline-05", depth, turned);
    for (const ordered_json& row : run(scene, study("spline-05", 3, 12))) {
        INFO(depth << " " << row);
        CHECK(row.at("outcome") != "seated");
        CHECK(row.at("seated_s") == 0);
        CHECK((row.at("insert_s").get<double>() > 0) == (depth > 0));
    }
}

}  // namespace touchstone::trials_tests
