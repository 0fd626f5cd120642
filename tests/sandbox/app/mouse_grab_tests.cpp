// Picking and dragging, without a window.
#include <catch2/catch.hpp>

#include "haptics/sandbox/app/mouse_grab.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "tests/support/mesh_world.hpp"

namespace touchstone::mouse_grab_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;

namespace {

constexpr glm::vec2 kViewport{800, 600};

/// Looks along -z at the origin from 400 mm.
engine::OrbitCamera front() {
    engine::OrbitCamera camera;
    camera.distance = 0.4f;
    return camera;
}

/// A mouse over the picture that remembers its buttons.
struct Mouse {
    MouseGrab grab;
    engine::OrbitCamera camera = front();
    engine::MouseFrame frame{.cursor = 0.5f * kViewport, .viewport = kViewport};
    GrabTool tool;

    void step() {
        grab.update(frame, camera, tool.world ? &tool : nullptr);
        frame.wheel = 0;
    }
};

}  // namespace

TEST_CASE("picking: a ray finds the same point as a search of all leaves", "[mouse]") {
    const auto tree = blob(700, 40, 3);
    const World world = worldOf(tree, tree, {});
    const Pose X_WT = at(12, -7, 30, {0.3, -0.8, 0.4});
    const unsigned seed = 20240607;
    CAPTURE(seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    int hits = 0;
    for (int i = 0; i < 500; ++i) {
        const Vec3 origin = 200 * Vec3(normal(random), normal(random), normal(random)).normalized() + X_WT.p;
        const Vec3 aim = X_WT.p + 30 * Vec3(normal(random), normal(random), normal(random));
        const Vec3 d = (aim - origin).normalized();
        double nearest = 1e30;
        for (int leaf = 0; leaf < tree->leafCount(); ++leaf) {
            const Sphere s = tree->leaf(leaf);
            const Vec3 c = X_WT * Vec3(s.x, s.y, s.z) - origin;
            const double along = c.dot(d), half2 = double(s.r) * s.r - (c - along * d).squaredNorm();
            if (half2 >= 0 && along + std::sqrt(half2) >= 0) nearest = std::min(nearest, along - std::sqrt(half2));
        }
        const engine::Ray ray{glm::vec3(toMeters(origin)), glm::vec3(toGlm(d))};
        const auto hit = pickTool(world, X_WT, ray);
        // The ray is rounded to float, so either answer is right within a micron of a sphere's edge.
        if (hit.has_value() != (nearest < 1e29)) continue;
        if (!hit) continue;
        ++hits;
        CHECK((*hit - origin).norm() == Approx(std::max(nearest, 0.0)).margin(0.05));
    }
    CHECK(hits > 200);
}

TEST_CASE("picking: a ray meets the mesh of a closed tool, turned or not, and misses beside it", "[mouse]") {
    const World world = meshWorld(test::boxMesh({20, 30, 40}, {-10, -15, 0}), test::boxMesh({1, 1, 1}), {});
    const Pose X_WT = at(5, 0, 10);
    const auto from = [](const Vec3& p, const Vec3& d) {
        return engine::Ray{glm::vec3(toMeters(p)), glm::vec3(toGlm(d))};
    };
    const auto hit = pickTool(world, X_WT, from({0, 3, 200}, {0, 0, -1}));
    REQUIRE(hit);
    CHECK((*hit - Vec3(0, 3, 50)).norm() < 1e-3);
    CHECK_FALSE(pickTool(world, X_WT, from({-6, 3, 200}, {0, 0, -1})));
    CHECK_FALSE(pickTool(world, X_WT, from({0, 3, 200}, {0, 0, 1})));
    const auto turned = pickTool(world, at(5, 0, 10, {0, 0, M_PI / 2}), from({200, 0, 20}, {-1, 0, 0}));
    REQUIRE(turned);
    CHECK((*turned - Vec3(20, 0, 20)).norm() < 1e-3);
}

TEST_CASE("mouse: the held point of the tool follows the cursor in the view plane", "[mouse]") {
    const World world = worldOf(ball(20), ball(20), {});
    Mouse mouse;
    mouse.tool = {&world, {}, {}};
    mouse.step();
    CHECK(mouse.grab.hovering());
    mouse.frame.left = true;
    mouse.step();
    REQUIRE(mouse.grab.holding());
    CHECK(mouse.grab.wanted()->p.norm() < 1e-4);  // grabbing moves the tool only by float rounding
    CHECK(mouse.grab.anchor().z() == Approx(20).margin(1e-3));

    mouse.frame.cursor += glm::vec2(30, -40);
    mouse.step();
    // 380 mm before the eye a pixel is 2 tan(fovY / 2) 380 / 600 mm.
    const double pixel = 2 * std::tan(0.35) * 380 / 600;
    CHECK((mouse.grab.wanted()->p - Vec3(30 * pixel, 40 * pixel, 0)).norm() < 1e-3);

    mouse.frame.left = false;
    mouse.step();
    CHECK_FALSE(mouse.grab.holding());
    CHECK((mouse.grab.wanted()->p - Vec3(30 * pixel, 40 * pixel, 0)).norm() < 1e-3);  // the hand stays where it was
    CHECK(mouse.camera.yaw == front().yaw);
}

TEST_CASE("mouse: the wheel moves a held tool away along the cursor's ray", "[mouse]") {
    const World world = worldOf(ball(20), ball(20), {});
    Mouse mouse;
    mouse.tool = {&world, {}, {}};
    mouse.frame.left = true;
    mouse.step();
    mouse.frame.wheel = 2;
    mouse.step();
    CHECK(mouse.grab.wanted()->p.z() < -1);
    CHECK(mouse.grab.wanted()->p.head<2>().norm() < 1e-3);  // the cursor is in the center
    CHECK(mouse.camera.distance == front().distance);
}

TEST_CASE("mouse: turning keeps the center of the tree in place", "[mouse]") {
    const auto tree = treeOf({{5, 0, 0, 15}, {25, 0, 0, 15}});
    const World world = worldOf(tree, tree, {});
    Mouse mouse;
    mouse.tool = {&world, {}, {}};
    const Vec3 C = tree->center();
    mouse.frame.right = true;
    mouse.step();
    REQUIRE(mouse.grab.holding());
    mouse.frame.cursor += glm::vec2(50, 20);
    mouse.frame.wheel = 1;
    mouse.step();
    CHECK((*mouse.grab.wanted() * C - C).norm() < 1e-9);
    CHECK(logRotation(mouse.grab.wanted()->q).norm() > 0.1);
    // A drag to the right turns the front to the right: about +y.
    CHECK(logRotation(mouse.grab.wanted()->q).y() > 0.1);
}

TEST_CASE("mouse: beside the tool it moves the camera", "[mouse]") {
    const World world = worldOf(ball(5), ball(5), {});
    Mouse mouse;
    mouse.tool = {&world, {}, {}};
    mouse.frame.cursor = {20, 20};
    mouse.frame.left = true;
    mouse.step();
    mouse.frame.cursor += glm::vec2(40, 0);
    mouse.step();
    CHECK_FALSE(mouse.grab.holding());
    CHECK_FALSE(mouse.grab.wanted().has_value());
    CHECK(mouse.camera.yaw != front().yaw);
}

TEST_CASE("mouse: moves nothing over a panel, or after it enters the picture from a panel", "[mouse]") {
    Mouse mouse;
    mouse.frame.elsewhere = true;
    mouse.frame.left = true;
    mouse.frame.wheel = 3;
    mouse.step();
    mouse.frame.elsewhere = false;
    mouse.frame.cursor += glm::vec2(40, 0);
    mouse.step();
    CHECK(mouse.camera.yaw == front().yaw);
    CHECK(mouse.camera.distance == front().distance);
}

TEST_CASE("mouse: keys move a held tool in depth and turn it about the view's axes", "[mouse]") {
    const World world = worldOf(ball(20), ball(20), {});
    Mouse mouse;
    mouse.tool = {&world, {}, {}};
    mouse.frame.depthKeys = 3;
    mouse.frame.turnKeys = {0, 0.2f, 0};
    mouse.step();
    CHECK_FALSE(mouse.grab.wanted());  // nothing is held
    CHECK(mouse.camera.distance == front().distance);
    mouse.frame.left = true;
    mouse.step();
    CHECK(mouse.grab.wanted()->p.z() < -1);
    CHECK((logRotation(mouse.grab.wanted()->q) - Vec3(0, 0.2, 0)).norm() < 1e-6);
}

TEST_CASE("mouse: a press that does not move is a click", "[mouse]") {
    Mouse mouse;
    mouse.frame.left = true;
    mouse.step();
    CHECK_FALSE(mouse.grab.clicked());
    mouse.frame.left = false;
    mouse.step();
    CHECK(mouse.grab.clicked());
    mouse.step();
    CHECK_FALSE(mouse.grab.clicked());
    mouse.frame.left = true;
    mouse.step();
    mouse.frame.cursor += glm::vec2(20, 0);
    mouse.step();
    mouse.frame.cursor -= glm::vec2(20, 0);
    mouse.step();
    mouse.frame.left = false;
    mouse.step();
    CHECK_FALSE(mouse.grab.clicked());  // it was a drag, although the cursor returned
}

}  // namespace touchstone::mouse_grab_tests
