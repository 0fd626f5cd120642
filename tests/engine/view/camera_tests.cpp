// Camera geometry against numbers derived by hand.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "engine/view/camera.hpp"

namespace touchstone::camera_tests {

using namespace touchstone::engine;

namespace {

constexpr float kTolerance = 1e-5f;  // a few float roundings of numbers near 1

void requireNear(glm::vec3 actual, glm::vec3 expected, float tolerance = kTolerance) {
    INFO("actual " << actual.x << ' ' << actual.y << ' ' << actual.z << ", expected " << expected.x << ' ' << expected.y
                   << ' ' << expected.z);
    REQUIRE(glm::distance(actual, expected) <= tolerance);
}

/// Looks along -z from (0, 0, 2); the view plane through the origin is 2 m high: one pixel of 200 is 1 cm.
OrbitCamera plainCamera() {
    OrbitCamera camera;
    camera.distance = 2;
    camera.fovY = 2 * std::atan(0.5f);
    return camera;
}

}  // namespace

TEST_CASE("camera: yaw and pitch place the eye about the target", "[camera]") {
    OrbitCamera camera = plainCamera();
    requireNear(camera.eye(), {0, 0, 2});
    requireNear(camera.right(), {1, 0, 0});
    requireNear(camera.up(), {0, 1, 0});

    camera.yaw = glm::half_pi<float>();  // from the +x side
    requireNear(camera.eye(), {2, 0, 0});
    requireNear(camera.right(), {0, 0, -1});

    camera.yaw = 0;
    camera.pitch = glm::quarter_pi<float>();  // from above
    requireNear(camera.eye(), {0, std::sqrt(2.f), std::sqrt(2.f)});
}

TEST_CASE("camera: a drag to the right turns the scene to the right", "[camera]") {
    OrbitCamera camera = plainCamera();
    const glm::vec3 front{0, 0, 0.5f};
    const glm::vec2 viewport{400, 200};
    const float before = camera.project(front, viewport)->x;
    camera.orbit(0.2f, 0);
    REQUIRE(camera.project(front, viewport)->x > before);
}

TEST_CASE("camera: orbiting never tips over", "[camera]") {
    OrbitCamera camera = plainCamera();
    for (int i = 0; i < 100; ++i) camera.orbit(1, 1);
    REQUIRE(camera.pitch < glm::half_pi<float>());
    REQUIRE(camera.up().y > 0);
    REQUIRE(std::abs(camera.yaw) <= glm::pi<float>() + kTolerance);
}

TEST_CASE("camera: pixels map to the view plane by hand", "[camera]") {
    const OrbitCamera camera = plainCamera();
    const glm::vec2 viewport{400, 200};
    REQUIRE(camera.metersPerPixel({0, 0, 0}, viewport.y) == Approx(0.01f));
    REQUIRE(camera.metersPerPixel({0, 0, 1}, viewport.y) == Approx(0.005f));  // half as far

    requireNear(camera.onViewPlane({200, 100}, viewport, {0, 0, 0}), {0, 0, 0});
    requireNear(camera.onViewPlane({400, 0}, viewport, {0, 0, 0}), {2, 1, 0});
    // Dragging 10 pixels right and 20 down at depth 1 moves by 5 cm and 10 cm.
    const glm::vec3 anchor{0.3f, 0.2f, 1};
    requireNear(camera.onViewPlane({110, 70}, viewport, anchor) - camera.onViewPlane({100, 50}, viewport, anchor),
                {0.05f, -0.1f, 0});

    const Ray corner = camera.ray({400, 0}, viewport);
    requireNear(corner.origin, {0, 0, 2});
    requireNear(corner.direction, glm::normalize(glm::vec3(2, 1, -2)));
}

TEST_CASE("camera: panning moves points at the target's depth with the mouse", "[camera]") {
    OrbitCamera camera = plainCamera();
    camera.pan({10, 20}, 200);
    requireNear(camera.target, {-0.1f, 0.2f, 0});
    // The point at the center is now 10 pixels right and 20 down.
    const auto pixel = camera.project({0, 0, 0}, {400, 200});
    REQUIRE(pixel);
    REQUIRE(pixel->x == Approx(210));
    REQUIRE(pixel->y == Approx(120));
}

TEST_CASE("camera: eight wheel steps zoom by the factor e", "[camera]") {
    OrbitCamera camera = plainCamera();
    camera.zoom(8);
    REQUIRE(camera.distance == Approx(2 / std::exp(1.f)));
    camera.zoom(-8);
    REQUIRE(camera.distance == Approx(2));
    camera.zoom(1e6f);
    REQUIRE(camera.distance > 0);
    camera.zoom(-1e6f);
    REQUIRE(std::isfinite(camera.distance));
}

TEST_CASE("camera: a framed sphere touches the narrower sides of the viewport", "[camera]") {
    OrbitCamera camera;
    camera.yaw = 0.7f;
    camera.pitch = 0.4f;
    const glm::vec3 center{1, 2, 3};
    for (const float aspect : {0.5f, 1.f, 1.6f}) {
        camera.frame(center, 0.1f, aspect);
        // The tangent of the outline's angle: the sphere subtends asin(r / d).
        const float outline = std::tan(std::asin(0.1f / glm::distance(camera.eye(), center)));
        REQUIRE(outline == Approx(std::tan(camera.fovY / 2) * std::min(aspect, 1.f)));
        requireNear(camera.target, center);
    }
}

TEST_CASE("camera: project, ray and the matrices agree on random poses", "[camera]") {
    const std::uint32_t seed = 20240611;
    INFO("seed " << seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(-1, 1);
    const glm::vec2 viewport{640, 360};
    for (int trial = 0; trial < 200; ++trial) {
        OrbitCamera camera;
        camera.target = {unit(random), unit(random), unit(random)};
        camera.distance = 1.5f + unit(random);
        camera.yaw = 3 * unit(random);
        camera.pitch = 1.5f * unit(random);
        const glm::vec3 point =
            camera.target + 0.2f * camera.distance * glm::vec3(unit(random), unit(random), unit(random));

        const auto pixel = camera.project(point, viewport);
        REQUIRE(pixel);
        const glm::vec4 clip = camera.projection(viewport.x / viewport.y) * camera.view() * glm::vec4(point, 1);
        // Float products in a viewport of several hundred pixels are accurate to a hundredth of a pixel.
        REQUIRE((0.5f + 0.5f * clip.x / clip.w) * viewport.x == Approx(pixel->x).margin(0.01));
        REQUIRE((0.5f - 0.5f * clip.y / clip.w) * viewport.y == Approx(pixel->y).margin(0.01));
        REQUIRE(std::abs(clip.z) < clip.w);  // inside the depth range

        const Ray ray = camera.ray(*pixel, viewport);
        requireNear(ray.at(glm::dot(point - ray.origin, ray.direction)), point);
        requireNear(camera.onViewPlane(*pixel, viewport, point), point);
    }
}

TEST_CASE("camera: rays meet planes in front of them only", "[camera]") {
    const Ray down{{1, 3, 2}, {0, -1, 0}};
    const auto hit = intersectPlane(down, {0, 0.5f, 0}, {0, 1, 0});
    REQUIRE(hit);
    requireNear(*hit, {1, 0.5f, 2});
    REQUIRE_FALSE(intersectPlane(down, {0, 4, 0}, {0, 1, 0}));  // behind
    REQUIRE_FALSE(intersectPlane(down, {0, 0, 0}, {1, 0, 0}));  // parallel
}

TEST_CASE("camera: a point behind the eye has no pixel", "[camera]") {
    REQUIRE_FALSE(plainCamera().project({0, 0, 3}, {400, 200}));
}

TEST_CASE("camera: standard views look along the axes, and zooming keeps the point under the cursor", "[view]") {
    OrbitCamera camera;
    camera.target = {0.1f, 0.2f, 0.3f};
    const glm::vec2 viewport{800, 600};
    const std::pair<StandardView, glm::vec3> sides[]{
        {StandardView::Front, {0, 0, -1}}, {StandardView::Back, {0, 0, 1}}, {StandardView::Right, {-1, 0, 0}},
        {StandardView::Left, {1, 0, 0}},   {StandardView::Top, {0, -1, 0}}, {StandardView::Bottom, {0, 1, 0}}};
    for (const auto& side : sides) {
        camera.look(side.first);
        CHECK(glm::length(camera.forward() - side.second) <
              0.011f);  // 0.01 rad off the vertical, so that `up` stays defined
        CHECK(camera.target == glm::vec3(0.1f, 0.2f, 0.3f));
    }
    camera.look(StandardView::Front);
    const glm::vec2 cursor{700, 100};
    const glm::vec3 under = camera.onViewPlane(cursor, viewport, camera.target);
    camera.zoom(5, cursor, viewport);
    const auto after = camera.project(under, viewport);
    REQUIRE(after);
    CHECK(glm::length(*after - cursor) < 0.1f);
    CHECK(camera.distance < 0.6f);
}

}  // namespace touchstone::camera_tests
