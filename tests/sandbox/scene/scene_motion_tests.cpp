#include <catch2/catch.hpp>

#include <numbers>

#include "haptics/sandbox/scene/scene_motion.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "tests/support/alloc_count.hpp"
#include "tests/support/scene_maker.hpp"

namespace touchstone::scene_motion_tests {

using namespace touchstone::test;
using Catch::Matchers::Contains;
using engine::AnimationPath;
using engine::Entity;
using engine::Interpolation;
using engine::Scene;

namespace {

constexpr double kPi = std::numbers::pi;

std::shared_ptr<const Motion> motionOf(Scene& scene, std::vector<std::string>& warnings) {
    updateWorldTransforms(scene);
    const sandbox::SceneRoles roles = sandbox::assignRoles(scene);
    const auto motions = sandbox::findMotions(scene, roles.tool, roles.obstacles, warnings);
    return motions.empty() ? nullptr : motions.front().motion;
}

const glm::vec3 kSize(0.01f);

}  // namespace

TEST_CASE("scene motion: converts keys to mm and ms, interpolates linearly and holds the ends", "[sandbox]") {
    Scene scene;
    const Entity tool = addBox(scene, "tool", kSize, {{"role", "tool"}});
    scene.animations.push_back(translation(tool, {0.5, 1.5}, {{0, 0, 0, 0}, {0.1, 0.02, 0, 0}}));
    std::vector<std::string> warnings;
    const auto motion = motionOf(scene, warnings);
    REQUIRE(motion);
    CHECK(warnings.empty());
    CHECK(motion->duration() == 1500);
    CHECK(motion->at(0).p.norm() == 0);
    CHECK(motion->at(500).p.norm() == 0);
    CHECK(motion->at(750).p.isApprox(Vec3(25, 5, 0)));
    CHECK(motion->at(1500).p.isApprox(Vec3(100, 20, 0)));
    CHECK(motion->at(9000).p.isApprox(Vec3(100, 20, 0)));
}

TEST_CASE("scene motion: steps hold, rotations take the shorter path, splines follow their tangents", "[sandbox]") {
    Scene scene;
    const Entity tool = addBox(scene, "tool", kSize, {{"role", "tool"}});
    const double s = std::sin(kPi / 8), c = std::cos(kPi / 8);
    scene.animations.push_back(
        {"motion",
         {{tool, AnimationPath::Rotation, Interpolation::Linear, {0, 1}, {{0, 0, 0, 1}, {0, -s, 0, -c}}},  // 45° about
                                                                                                           // y
          {tool,
           AnimationPath::Translation,
           Interpolation::CubicSpline,
           {0, 1},
           {{0, 0, 0, 0}, {0, 0, 0, 0}, {1, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}}}}});
    std::vector<std::string> warnings;
    const auto motion = motionOf(scene, warnings);
    // Half of 45° about y sends x to (cos 22.5°, 0, -sin 22.5°).
    CHECK((motion->at(500).q * Vec3::UnitX() - Vec3(std::cos(kPi / 8), 0, -std::sin(kPi / 8))).norm() < 1e-12);
    // Out-tangent 1 m/s at zero: h10(1/2) = 1/8, so 125 mm.
    CHECK(motion->at(500).p.isApprox(Vec3(125, 0, 0)));
    scene.animations[0].channels[1] = {
        tool, AnimationPath::Translation, Interpolation::Step, {0, 1}, {{0, 0, 0, 0}, {1, 0, 0, 0}}};
    const auto stepped = motionOf(scene, warnings);
    CHECK(stepped->at(999).p.norm() == 0);
    CHECK(stepped->at(1000).p.isApprox(Vec3(1000, 0, 0)));
}

TEST_CASE("scene motion: fixed ancestors transform the whole motion", "[sandbox]") {
    Scene scene;
    const Entity parent = addNode(
        scene, "table", {},
        {.translation = {0, 1, 0}, .rotation = glm::angleAxis(kPi / 2, glm::dvec3(0, 0, 1)), .scale = glm::dvec3(2)});
    const Entity tool = addBox(scene, "tool", kSize, {{"role", "tool"}}, {}, parent);
    scene.animations.push_back(translation(tool, {0, 1}, {{0, 0, 0, 0}, {0.1, 0, 0, 0}}));
    std::vector<std::string> warnings;
    const auto motion = motionOf(scene, warnings);
    // 0.1 m along the parent's x, doubled, turned to y, from 1 m up.
    CHECK((motion->at(1000).p - Vec3(0, 1200, 0)).norm() < 1e-9);
    CHECK((motion->at(1000).q * Vec3::UnitX() - Vec3::UnitY()).norm() < 1e-12);
    CHECK(warnings.empty());
}

TEST_CASE("scene motion: starts at the pose of the node", "[sandbox]") {
    const sandbox::HapticScene scene = sandbox::openScene(pressScene());
    const Pose rest = sandbox::toPose(engine::worldPose(scene.scene.registry, scene.roles.tool));
    CHECK((scene.demonstration->at(0).p - rest.p).norm() < 1e-9);
}

TEST_CASE("scene motion: uses the first animation that moves the tool", "[sandbox]") {
    Scene scene;
    const Entity lamp = addBox(scene, "lamp", kSize);
    const Entity tool = addBox(scene, "tool", kSize, {{"role", "tool"}});
    scene.animations.push_back(translation(lamp, {0, 1}, {{0, 0, 0, 0}, {1, 0, 0, 0}}));
    scene.animations.push_back(translation(tool, {0, 2}, {{0, 0, 0, 0}, {1, 0, 0, 0}}));
    scene.animations.push_back(translation(tool, {0, 3}, {{0, 0, 0, 0}, {1, 0, 0, 0}}));
    std::vector<std::string> warnings;
    CHECK(motionOf(scene, warnings)->duration() == 2000);
    CHECK(warnings.empty());  // a lamp that is only drawn may be animated
}

TEST_CASE("scene motion: animated ancestors, parts, obstacles and scale are named once each", "[sandbox]") {
    Scene scene;
    const Entity arm = addNode(scene, "arm");
    const Entity tool = addBox(scene, "tool", kSize, {{"role", "tool"}}, {}, arm);
    const Entity knob = addBox(scene, "knob", kSize, nullptr, {}, tool);
    const Entity carrier = addNode(scene, "carrier");
    addBox(scene, "wall", kSize, {{"role", "obstacle"}}, {}, carrier);
    for (const Entity node : {arm, knob, carrier, carrier})
        scene.animations.push_back(translation(node, {0, 1}, {{0, 0, 0, 0}, {1, 0, 0, 0}}));
    scene.animations.push_back(
        {"grow", {{tool, AnimationPath::Scale, Interpolation::Linear, {0, 1}, {{1, 1, 1, 0}, {2, 2, 2, 0}}}}});
    std::vector<std::string> warnings;
    CHECK(motionOf(scene, warnings) == nullptr);  // scale alone is not a motion
    REQUIRE(warnings.size() == 4);
    CHECK_THAT(warnings[0], Contains("\"arm\"") && Contains("ancestors"));
    CHECK_THAT(warnings[1], Contains("\"knob\"") && Contains("rigid"));
    CHECK_THAT(warnings[2], Contains("\"carrier\"") && Contains("obstacles"));
    CHECK_THAT(warnings[3], Contains("\"tool\"") && Contains("scale"));
}

TEST_CASE("scene motion: warns about a shape that would shear during the motion", "[sandbox]") {
    Scene scene;
    const Entity stretched = addNode(scene, "stretched", {}, {.scale = {1, 3, 1}});
    const Entity tool = addBox(scene, "tool", kSize, {{"role", "tool"}}, {}, stretched);
    const double s = std::sin(0.5), c = std::cos(0.5);
    scene.animations.push_back(
        {"turn", {{tool, AnimationPath::Rotation, Interpolation::Linear, {0, 1}, {{0, 0, 0, 1}, {s, 0, 0, c}}}}});
    std::vector<std::string> warnings;
    CHECK(motionOf(scene, warnings));
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0], Contains("uneven scale"));
}

TEST_CASE("scene motion: sampling allocates nothing", "[sandbox]") {
    const sandbox::HapticScene scene = sandbox::openScene(pressScene());
    const AllocationCounter counter;
    double sum = 0;
    for (double t = -10; t < 1000; t += 0.7) sum += scene.demonstration->at(t).p.y();
    CHECK(counter.count() == 0);
    CHECK(std::isfinite(sum));
}

}  // namespace touchstone::scene_motion_tests
