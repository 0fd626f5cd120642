// The handles of a body, without a window.
#include <catch2/catch.hpp>

#include "engine/edit/gizmo.hpp"

namespace touchstone::gizmo_tests {

using namespace touchstone::engine;

namespace {

constexpr glm::vec2 kViewport{800, 600};

glm::dquat rotation(const glm::dvec3& w) { return glm::angleAxis(glm::length(w), glm::normalize(w)); }

glm::dvec3 unit(int k) {
    glm::dvec3 axis(0);
    axis[k] = 1;
    return axis;
}

/// Rotation vector from one orientation to another.
glm::dvec3 turn(const glm::dquat& from, const glm::dquat& to) {
    const glm::dquat q = to * glm::conjugate(from), near = q.w < 0 ? -q : q;
    const glm::dvec3 v(near.x, near.y, near.z);
    const double s = glm::length(v);
    return s < 1e-12 ? 2. * v : 2 * std::atan2(s, near.w) / s * v;
}

/// A user who drags handles, seen from an oblique direction.
struct Hand {
    Gizmo gizmo;
    OrbitCamera camera;
    MouseFrame mouse{.viewport = kViewport};
    GizmoPlace place;
    bool snap = false;

    Hand() {
        camera.distance = 0.4f;
        camera.yaw = 0.5f;
        camera.pitch = 0.4f;
        place.body = {{0.010, -0.005, 0.020}, rotation({0.2, 0.7, -0.3})};
        place.pivot = {0.003, 0.004, 0.005};
    }
    std::optional<RigidPart> step() {
        const auto pose = gizmo.update(mouse, camera, place, snap);
        if (pose) place.body = *pose;
        return pose;
    }
    /// Grabs the handle.
    void take(GizmoHandle handle) {
        const auto at = Gizmo::grip(handle, camera, kViewport, place);
        REQUIRE(at);
        mouse.cursor = *at;
        step();
        REQUIRE(gizmo.handle() == handle);
        mouse.left = true;
        const RigidPart before = place.body;
        REQUIRE(step());
        CHECK(glm::distance(place.body.translation, before.translation) < 1e-6);  // grabbing moves nothing
    }
};

}  // namespace

TEST_CASE("gizmo: an axis handle moves along its axis only, and the grabbed point follows the cursor", "[gizmo]") {
    const bool ownAxes = GENERATE(false, true);
    const int k = GENERATE(0, 1, 2);
    CAPTURE(ownAxes, k);
    Hand hand;
    hand.place.ownAxes = ownAxes;
    const RigidPart start = hand.place.body;
    const glm::dvec3 axis = ownAxes ? start.rotation * unit(k) : unit(k);
    hand.take(GizmoHandle(int(GizmoHandle::MoveX) + k));
    // Drag to the screen position of the grip after a motion of 15 mm.
    GizmoPlace ahead = hand.place;
    ahead.body.translation += 0.015 * axis;
    const OrbitCamera& camera = hand.camera;
    const glm::vec3 held(hand.place.worldPivot() + 0.020 * axis), there(hand.place.worldPivot() + 0.035 * axis);
    hand.mouse.cursor += *camera.project(there, kViewport) - *camera.project(held, kViewport);
    REQUIRE(hand.step());
    const glm::dvec3 moved = hand.place.body.translation - start.translation;
    CHECK(glm::length(glm::cross(moved, axis)) < 1e-9);
    CHECK(glm::dot(moved, axis) > 0.008);
    CHECK(glm::dot(moved, axis) < 0.025);
    CHECK(glm::length(turn(start.rotation, hand.place.body.rotation)) < 1e-9);

    hand.snap = true;
    hand.step();
    const double snapped = 1000 * glm::dot(hand.place.body.translation - start.translation, axis);
    CHECK(std::abs(snapped - std::round(snapped)) < 1e-9);
    hand.mouse.left = false;
    CHECK_FALSE(hand.step());
    CHECK_FALSE(hand.gizmo.dragging());
}

TEST_CASE("gizmo: a ring turns about its axis through the pivot, also beyond half a turn", "[gizmo]") {
    Hand hand;
    const RigidPart start = hand.place.body;
    const glm::dvec3 pivot = hand.place.worldPivot();
    hand.take(GizmoHandle::TurnY);
    const glm::vec2 middle = *hand.camera.project(glm::vec3(pivot), kViewport);
    // One and a half turns around the pivot on the screen; y points down there, so this is counter-clockwise.
    const glm::vec2 r = hand.mouse.cursor - middle;
    double turned = 0, last = 0;
    for (int i = 1; i <= 108; ++i) {
        const float a = -float(i) * 5 * 0.01745329f;
        hand.mouse.cursor =
            middle + glm::vec2(std::cos(a) * r.x - std::sin(a) * r.y, std::sin(a) * r.x + std::cos(a) * r.y);
        REQUIRE(hand.step());
        const glm::dvec3 w = turn(start.rotation, hand.place.body.rotation);
        CHECK(glm::length(glm::cross(w, unit(1))) < 1e-6);
        turned += std::remainder(w.y - last, 2 * 3.14159265358979);
        last = w.y;
        CHECK(glm::distance(hand.place.worldPivot(), pivot) < 1e-9);
    }
    // Seen from above, counter-clockwise is +y. The ring is seen at an angle, so one and a half turns on the screen
    // equal one and a half turns about the axis only at the starting point.
    CHECK(turned == Approx(3 * 3.14159265358979).margin(1e-3));
}

TEST_CASE("gizmo: the middle handle moves in the view plane", "[gizmo]") {
    Hand hand;
    const RigidPart start = hand.place.body;
    hand.take(GizmoHandle::MovePlane);
    hand.mouse.cursor += glm::vec2(40, 25);
    hand.step();
    const glm::dvec3 moved = hand.place.body.translation - start.translation;
    CHECK(std::abs(glm::dot(moved, glm::dvec3(hand.camera.forward()))) < 1e-6);
    CHECK(glm::dot(moved, glm::dvec3(hand.camera.right())) > 0.005);
}

TEST_CASE("gizmo: over a panel, with another button, or far away nothing is grabbed", "[gizmo]") {
    Hand hand;
    hand.mouse.cursor = *Gizmo::grip(GizmoHandle::MoveX, hand.camera, kViewport, hand.place);
    hand.mouse.elsewhere = true;
    hand.step();
    CHECK(hand.gizmo.handle() == GizmoHandle::None);
    hand.mouse.left = true;
    hand.step();
    hand.mouse.elsewhere = false;  // entered the picture with the button down
    CHECK_FALSE(hand.step());
    hand.mouse.left = false;
    hand.mouse.right = true;
    hand.step();
    CHECK(hand.gizmo.handle() == GizmoHandle::None);
    hand.mouse.right = false;
    hand.mouse.cursor = {5, 5};
    hand.step();
    CHECK(hand.gizmo.handle() == GizmoHandle::None);
}

}  // namespace touchstone::gizmo_tests
