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
        grab.update(frame, camera, tool.tree || tool.surface ? &tool : nullptr);
        frame.wheel = 0;
    }
};

}  // namespace

TEST_CASE("picking: a ray finds the same point as a search of all leaves", "[mouse]") {
    const auto tree = blob(700, 40, 3);
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
        const auto hit = pickTree(*tree, X_WT, ray);
        // The ray is rounded to float, so either answer is right within a micron of a sphere's edge.
        if (hit.has_value() != (nearest < 1e29)) continue;
        if (!hit) continue;
        ++hits;
        CHECK((*hit - origin).norm() == Approx(std::max(nearest, 0.0)).margin(0.05));
    }
    CHECK(hits > 200);
}

TEST_CASE("mouse: the held point of the tool follows the cursor in the view plane", "[mouse]") {
    const auto tree = ball(20);
    Mouse mouse;
    mouse.tool = {.tree = tree.get(), .p_TC = tree->center()};
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
    const auto tree = ball(20);
    Mouse mouse;
    mouse.tool = {.tree = tree.get(), .p_TC = tree->center()};
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
    Mouse mouse;
    mouse.tool = {.tree = tree.get(), .p_TC = tree->center()};
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
    const auto tree = ball(5);
    Mouse mouse;
    mouse.tool = {.tree = tree.get(), .p_TC = tree->center()};
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
    const auto tree = ball(20);
    Mouse mouse;
    mouse.tool = {.tree = tree.get(), .p_TC = tree->center()};
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

TEST_CASE("picking: a tool with a mesh is grabbed where the ray meets the mesh, whatever its tree", "[mouse]") {
    const auto surface = std::make_shared<const Surface>(surfaceOf(boxMesh({20, 20, 20}, {-10, -10, -10})));
    const auto tree = GENERATE(std::shared_ptr<const SphereTree>(), ball(1));
    Mouse mouse;
    mouse.tool = {.tree = tree.get(), .surface = surface.get(), .p_TC = surface->extent.center};
    mouse.frame.cursor.x += 15;  // a few mm off the ball, well within the box
    mouse.step();
    CHECK(mouse.grab.hovering());
    mouse.frame.left = true;
    mouse.step();
    REQUIRE(mouse.grab.holding());
    CHECK(mouse.grab.anchor().z() == Approx(10).margin(1e-4));
    mouse.frame.left = false;
    mouse.step();
    mouse.frame.cursor = {5, 5};
    mouse.step();
    CHECK_FALSE(mouse.grab.hovering());
}

}  // namespace touchstone::mouse_grab_tests
