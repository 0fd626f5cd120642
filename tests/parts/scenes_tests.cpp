#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/scene/gltf_write.hpp"
#include "tests/support/temp_folder.hpp"
#include "tools/parts/scene_kit.hpp"
#include "tools/parts/scenes.hpp"

namespace touchstone::app::scenes_tests {
namespace {

const SceneInfo& sceneNamed(std::string_view name) {
    for (const SceneInfo& scene : sceneTable())
        if (scene.name == name) return scene;
    FAIL("there is no scene with this name");
    return sceneTable().front();
}

nlohmann::json marking(const engine::Scene& scene, std::size_t node) {
    return scene.registry.get<engine::NodeMarking>(scene.nodes.at(node)).extras->at("touchstone");
}

glm::dvec3 toolAt(const engine::Scene& scene, double seconds) {
    const engine::Entity tool = scene.nodes.at(0);
    const auto& rest = scene.registry.get<engine::LocalTransform>(tool);
    return 1000.0 * engine::sampleNode(scene.animations.at(0), tool, rest, seconds).translation;
}

}  // namespace

TEST_CASE("demonstration: pieces follow each other at the speeds given", "[parts]") {
    Demonstration motion({{1, 0, 0}});
    motion.hold(0.5);
    motion.moveTo({{1, 0, 30}}, 0.25);
    motion.follow(0.1, [](double t) { return ToolPose{{1 + 100 * t, 0, 30}}; });
    engine::Scene scene;
    const engine::Entity node = addNode(scene, "tool");
    scene.animations.push_back(motion.animation(node));
    CHECK(engine::endTime(scene.animations[0]) == Approx(0.85));
    CHECK(toolAt(scene, 0.5).z == Approx(0).margin(1e-12));
    CHECK(toolAt(scene, 0.6).z == Approx(12));  // 0.1 s at 120 mm/s
    CHECK(toolAt(scene, 0.8).x == Approx(6));
    CHECK(toolAt(scene, 2).x == Approx(11));
}

TEST_CASE("first contact: two balls meet at the sum of their radii", "[parts]") {
    const SphereTree tool = makeSphereTree({{1, 0, 0, 2}}), obstacle = makeSphereTree({{0, 0, 0, 3}});
    // The tool's ball is 1 beside its origin; after a turn of 90 degrees about z, it is 1 above.
    const ToolPose start{{20, -1, 0}, glm::angleAxis(std::acos(0.0), glm::dvec3(0, 0, 1))};
    CHECK(travelToContact(tool, obstacle, start, {-1, 0, 0}) == Approx(15).margin(2e-4));
    CHECK_THROWS_AS(travelToContact(tool, obstacle, start, {1, 0, 0}), engine::SceneError);
    // Off center by 4: contact at a height of sqrt(25 - 16) = 3.
    CHECK(travelToContact(tool, obstacle, {{19, 4, 0}}, {-1, 0, 0}) == Approx(17).margin(1e-3));
}

TEST_CASE("scenes: plate drives the ball past the plate at each speed, in its cases 60 mm, and ends above", "[parts]") {
    const engine::Scene scene = sceneNamed("plate").make({});
    const auto check = [&](const auto& isOne, const std::set<int>& wanted, double below) {
        std::set<int> speeds;  // mm/s
        for (const engine::Animation& animation : scene.animations) {
            if (!isOne(animation.name)) continue;
            const engine::AnimationChannel& path = animation.channels.at(0);
            double lowest = 0;
            for (std::size_t i = 1; i < path.times.size(); ++i) {
                const double fall = 1000 * (path.values[i - 1].y - path.values[i].y);
                lowest = std::min(lowest, 1000 * path.values[i].y);
                if (path.values[i].y < 0 && path.values[i - 1].y > 0)
                    speeds.insert(static_cast<int>(std::lround(fall / (path.times[i] - path.times[i - 1]))));
            }
            CHECK(lowest <= -below);
        }
        CHECK(speeds == wanted);
    };
    check([](const std::string& name) { return name == "demonstration"; }, {200, 500, 1000}, 8);
    check([](const std::string& name) { return name.starts_with("hard-04-plate"); }, {200, 1000, 3000, 10000},
          0.5 + 12 + 60);
    CHECK(scene.animations.at(0).channels.at(0).values.back().y > 0.0125);
    CHECK(marking(scene, 0).at("role") == "tool");
    CHECK(marking(scene, 1).at("role") == "obstacle");
}

TEST_CASE("scenes: spline has clearance, goal and outcome that follow its dimensions", "[parts]") {
    SceneOptions options;
    options.fit.clearance = 0.2;
    options.leaves = 12000;
    const engine::Scene scene = sceneNamed("spline").make(options);
    CHECK(scene.extras->at("touchstone").at("clearance_mm").get<double>() == 0.2);
    CHECK(marking(scene, 0).at("leaves") == 12000);
    CHECK(marking(scene, 0).at("outcome").at("seated") == true);
    CHECK(marking(scene, 2).at("role") == "goal");
    // Seated: the shaft's lower end, half its length below the origin, on the bottom of the hole.
    const auto& goal = scene.registry.get<engine::LocalTransform>(scene.nodes.at(2));
    CHECK(goal.translation.y == Approx((options.fit.length / 2 - options.fit.depth) / 1000));
    CHECK(toolAt(scene, 0).y == Approx(options.fit.length / 2 + 15));
    CHECK(toolAt(scene, 100).y == Approx(options.fit.length / 2 - options.fit.depth - 1));
}

TEST_CASE("scenes: the goal of a close fit asks for the true fit", "[parts]") {
    SceneOptions options;
    options.fit.clearance = 0.02;
    for (const char* name : {"spline", "peg", "nut"}) {
        INFO(name);
        const engine::Scene scene = sceneNamed(name).make(options);
        CHECK(marking(scene, 0).at("outcome").at("seated") == true);
        const nlohmann::json goal = marking(scene, scene.nodes.size() - 1).at("goal");
        const double clearance = name == std::string("spline") ? 0.02 : name == std::string("peg") ? 0.01 : 0.05;
        CHECK(scene.extras->at("touchstone") == nlohmann::json{{"clearance_mm", clearance}});
        CHECK(goal.at("tolerance_m").get<double>() <= 1.5 * clearance / 1000 + 1e-12);
    }
}

TEST_CASE("scenes: pebbles are made on request only, with the same motion for any number of triangles", "[parts]") {
    const SceneInfo& pebbles = sceneNamed("pebbles");
    CHECK(bundledVariants(pebbles).empty());
    CHECK(bundledVariants(sceneNamed("nut")).size() == 1);
    SceneOptions options;
    options.triangles = 1000;
    const engine::Scene coarse = pebbles.make(options);
    options.triangles = 3000;
    const engine::Scene fine = pebbles.make(options);
    for (const double seconds : {0.0, 0.7, 1.3, 2.0, 3.3}) CHECK(toolAt(coarse, seconds) == toolAt(fine, seconds));
    CHECK(marking(coarse, 0).at("role") == "tool");
    CHECK(marking(coarse, 0).at("outcome") == marking(fine, 0).at("outcome"));
    CHECK(marking(coarse, 1).at("role") == "obstacle");
}

TEST_CASE("scenes: a scene is written with the same bytes each time", "[parts]") {
    const test::TempFolder folder;
    const std::filesystem::path file = folder.path() / "scene.glb";
    for (const char* name : {"spline", "peg", "nut"}) {
        INFO(name);
        std::string bytes[2];
        for (std::string& written : bytes) {
            SceneOptions options;
            options.fit.clearance = 0.02;
            engine::writeGltf(sceneNamed(name).make(options), file);
            std::ifstream in(file, std::ios::binary);
            written.assign(std::istreambuf_iterator<char>(in), {});
        }
        CHECK(bytes[0].size() > 100'000);
        CHECK(bytes[0] == bytes[1]);
    }
}

TEST_CASE("scenes: a missing bunny is reported with the package that contains it", "[parts]") {
    SceneOptions options;
    options.bunny = "no/such/bunny.obj";
    CHECK_THROWS_WITH(sceneNamed("wedge").make(options), Catch::Contains("glmark2-data"));
}

}  // namespace touchstone::app::scenes_tests
