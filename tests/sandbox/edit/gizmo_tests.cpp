// The handles around a body, without a window.
#include <catch2/catch.hpp>

#include "haptics/sandbox/edit/gizmo.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::gizmo_tests {

using namespace touchstone::sandbox;

namespace {

constexpr glm::vec2 kViewport{800, 600};

/// A user who drags handles, seen from an oblique direction.
struct Hand {
    Gizmo gizmo;
    engine::OrbitCamera camera;
    MouseFrame mouse{.viewport = kViewport};
    GizmoPlace place;
    bool snap = false;

    Hand() {
        camera.distance = 0.4f;
        camera.yaw = 0.5f;
        camera.pitch = 0.4f;
        place.X_WB = {{10, -5, 20}, expRotation({0.2, 0.7, -0.3})};
        place.p_BP = Vec3(3, 4, 5);
    }
    std::optional<Pose> step() {
        const auto pose = gizmo.update(mouse, camera, place, snap);
        if (pose) place.X_WB = *pose;
        return pose;
    }
    Vec3 pivot() const { return place.X_WB * place.p_BP; }
    /// Takes hold of the handle.
    void take(GizmoHandle handle) {
        const auto at = Gizmo::grip(handle, camera, kViewport, place);
        REQUIRE(at);
        mouse.cursor = *at;
        step();
        REQUIRE(gizmo.handle() == handle);
        mouse.left = true;
        const Pose before = place.X_WB;
        REQUIRE(step());
        CHECK((place.X_WB.p - before.p).norm() < 1e-3);  // taking hold moves nothing
    }
};

}  // namespace

TEST_CASE("gizmo: an axis moves along itself alone, and the point under the cursor follows it", "[gizmo]") {
    const bool ownAxes = GENERATE(false, true);
    const int k = GENERATE(0, 1, 2);
    CAPTURE(ownAxes, k);
    Hand hand;
    hand.place.ownAxes = ownAxes;
    const Pose start = hand.place.X_WB;
    const Vec3 axis = ownAxes ? Vec3(start.q * Vec3::Unit(k)) : Vec3(Vec3::Unit(k));
    hand.take(GizmoHandle(int(GizmoHandle::MoveX) + k));
    // To where the grip is on the screen once the body is 15 mm further on.
    GizmoPlace ahead = hand.place;
    ahead.X_WB.p += 15 * axis;
    const engine::OrbitCamera& camera = hand.camera;
    const glm::vec3 held(toMetres(Vec3(hand.pivot() + 20 * axis))), there(toMetres(Vec3(hand.pivot() + 35 * axis)));
    hand.mouse.cursor += *camera.project(there, kViewport) - *camera.project(held, kViewport);
    REQUIRE(hand.step());
    const Vec3 moved = hand.place.X_WB.p - start.p;
    CHECK(moved.cross(axis).norm() < 1e-6);
    CHECK(moved.dot(axis) > 8);
    CHECK(moved.dot(axis) < 25);
    CHECK(logRotation(hand.place.X_WB.q * start.q.conjugate()).norm() < 1e-9);

    hand.snap = true;
    hand.step();
    const double snapped = (hand.place.X_WB.p - start.p).dot(axis);
    CHECK(std::abs(snapped - std::round(snapped)) < 1e-9);
    hand.mouse.left = false;
    CHECK_FALSE(hand.step());
    CHECK_FALSE(hand.gizmo.dragging());
}

TEST_CASE("gizmo: a ring turns about its axis through the pivot, past half a turn too", "[gizmo]") {
    Hand hand;
    const Pose start = hand.place.X_WB;
    const Vec3 pivot = hand.pivot();
    hand.take(GizmoHandle::TurnY);
    const glm::vec2 middle = *hand.camera.project(glm::vec3(toMetres(pivot)), kViewport);
    // Once around the pivot on the screen and half a turn more; y points down there, so this is against the clock.
    const glm::vec2 r = hand.mouse.cursor - middle;
    double turned = 0, last = 0;
    for (int i = 1; i <= 108; ++i) {
        const float a = -float(i) * 5 * 0.01745329f;
        hand.mouse.cursor =
            middle + glm::vec2(std::cos(a) * r.x - std::sin(a) * r.y, std::sin(a) * r.x + std::cos(a) * r.y);
        REQUIRE(hand.step());
        const Vec3 w = logRotation(hand.place.X_WB.q * start.q.conjugate());
        CHECK(w.cross(Vec3::UnitY()).norm() < 1e-6);
        turned += std::remainder(w.y() - last, 2 * 3.14159265358979);
        last = w.y();
        CHECK((hand.pivot() - pivot).norm() < 1e-6);
    }
    // Seen from above, against the clock is +y. The ring is seen at a slant, so a turn and a half on the screen is one
    // and a half about the axis only where it began.
    CHECK(turned == Approx(3 * 3.14159265358979).margin(1e-3));
}

TEST_CASE("gizmo: the middle moves in the view plane", "[gizmo]") {
    Hand hand;
    const Pose start = hand.place.X_WB;
    hand.take(GizmoHandle::MovePlane);
    hand.mouse.cursor += glm::vec2(40, 25);
    hand.step();
    const Vec3 moved = hand.place.X_WB.p - start.p;
    const glm::vec3 f = hand.camera.forward(), r = hand.camera.right();
    CHECK(std::abs(moved.dot(Vec3(f.x, f.y, f.z))) < 1e-3);
    CHECK(moved.dot(Vec3(r.x, r.y, r.z)) > 5);
}

TEST_CASE("gizmo: over a panel, with another button, or far away nothing is taken", "[gizmo]") {
    Hand hand;
    hand.mouse.cursor = *Gizmo::grip(GizmoHandle::MoveX, hand.camera, kViewport, hand.place);
    hand.mouse.elsewhere = true;
    hand.step();
    CHECK(hand.gizmo.handle() == GizmoHandle::None);
    hand.mouse.left = true;
    hand.step();
    hand.mouse.elsewhere = false;  // slid in with the button down
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

TEST_CASE("camera: standard views look along the axes, and zooming keeps what is under the cursor", "[gizmo]") {
    engine::OrbitCamera camera;
    camera.target = {0.1f, 0.2f, 0.3f};
    using engine::StandardView;
    const std::pair<StandardView, glm::vec3> sides[]{
        {StandardView::Front, {0, 0, -1}}, {StandardView::Back, {0, 0, 1}}, {StandardView::Right, {-1, 0, 0}},
        {StandardView::Left, {1, 0, 0}},   {StandardView::Top, {0, -1, 0}}, {StandardView::Bottom, {0, 1, 0}}};
    for (const auto& side : sides) {
        camera.look(side.first);
        CHECK(glm::length(camera.forward() - side.second) < 0.011f);  // `up` stays defined: 0.01 rad off the vertical
        CHECK(camera.target == glm::vec3(0.1f, 0.2f, 0.3f));
    }
    camera.look(StandardView::Front);
    const glm::vec2 cursor{700, 100};
    const glm::vec3 under = camera.onViewPlane(cursor, kViewport, camera.target);
    camera.zoom(5, cursor, kViewport);
    const auto after = camera.project(under, kViewport);
    REQUIRE(after);
    CHECK(glm::length(*after - cursor) < 0.1f);
    CHECK(camera.distance < 0.6f);
}

}  // namespace touchstone::gizmo_tests
