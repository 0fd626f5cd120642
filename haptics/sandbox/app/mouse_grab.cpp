#include "haptics/sandbox/app/mouse_grab.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "haptics/sandbox/scene/units.hpp"
#include "haptics/surface/surface_distance.hpp"

namespace touchstone::sandbox {
namespace {

constexpr float kOrbitPerPixel = 0.008f;     // radians
constexpr float kTurnPerPixel = 0.006f;      // radians
constexpr float kTurnPerWheelStep = 0.06f;   // radians
constexpr float kClickPixels = 4;            // beyond this, a press is a drag
constexpr float kDepthPerWheelStep = 0.01f;  // relative to the distance from the eye

/// Finds the nearest hit of a ray p + s d (|d| = 1, mm, body frame) among the leaves of a tree.
struct RayWalk {
    const SphereTree& tree;
    Vec3 p, d;
    double nearest = std::numeric_limits<double>::infinity();

    /// Distance s at which the ray enters the sphere; 0 if it starts inside, infinity if it misses.
    double enter(const Sphere& sphere) const {
        const Vec3 c(sphere.x, sphere.y, sphere.z);
        const double r = sphere.r, along = (c - p).dot(d);
        const double half2 = r * r - (c - p - along * d).squaredNorm();
        if (half2 < 0) return std::numeric_limits<double>::infinity();
        const double half = std::sqrt(half2);
        if (along + half < 0) return std::numeric_limits<double>::infinity();
        return std::max(along - half, 0.0);
    }

    void descend(std::size_t level, int block) {
        const double s = enter(tree.block(static_cast<int>(level), block));
        if (s >= nearest) return;
        if (level == 0) {
            nearest = s;
            return;
        }
        const int first = SphereTree::kBranching * block;
        const int last = std::min(first + SphereTree::kBranching, tree.levels[level - 1].count);
        for (int child = first; child < last; ++child) descend(level - 1, child);
    }
};

Vec3 direction(const glm::vec3& v) { return {v.x, v.y, v.z}; }

}  // namespace

std::optional<Vec3> pickTool(const World& world, const Pose& X_WT, const engine::Ray& ray) {
    const Pose X_TW = X_WT.inverse();
    const Vec3 d_W = direction(ray.direction).normalized(), p = X_TW * toMm(ray.origin), d = X_TW.q * d_W;
    if (world.tool.surface) {
        const auto hit = firstHit(*world.tool.surface, p, d);
        return hit ? std::optional<Vec3>(X_WT * *hit) : std::nullopt;
    }
    RayWalk walk{*world.tool.spheres, p, d};
    walk.descend(world.tool.spheres->levels.size() - 1, 0);
    if (!std::isfinite(walk.nearest)) return std::nullopt;
    return toMm(ray.origin) + walk.nearest * d_W;
}

void MouseGrab::reset() {
    drag_ = Drag::None;
    wanted_.reset();
}

void MouseGrab::begin(const engine::MouseFrame& mouse, const engine::OrbitCamera& camera, const GrabTool* tool) {
    hovering_ = false;
    if (mouse.elsewhere) return;
    std::optional<Vec3> hit;
    if (tool) hit = pickTool(*tool->world, tool->X_WT, camera.ray(mouse.cursor, mouse.viewport));
    hovering_ = hit.has_value();

    if (!buttonsUp_ || !(mouse.left || mouse.middle || mouse.right)) return;
    if (hit && !mouse.middle) {
        anchor_ = *hit;
        held_T_ = tool->X_WT.inverse() * *hit;
        if (!wanted_) wanted_ = tool->X_WT_device;
        drag_ = Drag::Move;
    } else {
        drag_ = mouse.left && !mouse.turnKey ? Drag::Orbit : Drag::Pan;
    }
}

void MouseGrab::move(const engine::MouseFrame& mouse, const engine::OrbitCamera& camera) {
    const engine::Ray ray = camera.ray(mouse.cursor, mouse.viewport);
    Vec3 target = toMm(camera.onViewPlane(mouse.cursor, mouse.viewport, toMeters(anchor_)));
    const double step = static_cast<double>((mouse.wheel + mouse.depthKeys) * kDepthPerWheelStep);
    target +=
        step * (target - toMm(ray.origin));  // moving along the cursor's ray keeps the held point under the cursor
    wanted_->p += target - anchor_;
    anchor_ = target;
}

void MouseGrab::turn(const Vec3& w, const Vec3& p_TC) {
    const Quat dq = expRotation(w);
    const Vec3 p_WC = *wanted_ * p_TC;
    wanted_->p = p_WC + dq * (wanted_->p - p_WC);
    wanted_->q = (dq * wanted_->q).normalized();
}

void MouseGrab::update(const engine::MouseFrame& mouse, engine::OrbitCamera& camera, const GrabTool* tool) {
    const bool anyButton = mouse.left || mouse.middle || mouse.right;
    if (pressed_ && glm::length(mouse.cursor - *pressed_) > kClickPixels) pressed_.reset();
    clicked_ = pressed_ && !anyButton;
    if (!anyButton) pressed_.reset();
    if (buttonsUp_ && mouse.left && !mouse.elsewhere) pressed_ = mouse.cursor;
    if (drag_ != Drag::None && (!anyButton || (holding() && !tool))) drag_ = Drag::None;
    if (drag_ == Drag::None) {
        begin(mouse, camera, tool);
        if (drag_ != Drag::None) cursor_ = mouse.cursor;  // a drag must not start with a jump
    }
    if (holding()) drag_ = mouse.right || mouse.turnKey ? Drag::Turn : Drag::Move;

    const glm::vec2 pixels = mouse.cursor - cursor_;
    const glm::vec3 byKeys =
        camera.right() * mouse.turnKeys.x + camera.up() * mouse.turnKeys.y + camera.forward() * mouse.turnKeys.z;
    switch (drag_) {
        case Drag::Move:
            move(mouse, camera);
            if (mouse.turnKeys != glm::vec3(0)) turn(direction(byKeys), tool->world->p_TC());
            break;
        case Drag::Turn:
            turn(direction(kTurnPerPixel * (pixels.x * camera.up() + pixels.y * camera.right()) +
                           kTurnPerWheelStep * mouse.wheel * camera.forward() + byKeys),
                 tool->world->p_TC());
            // The held point turns with the tool away from the cursor, so a following drag continues from the cursor.
            anchor_ = toMm(camera.onViewPlane(mouse.cursor, mouse.viewport, toMeters(anchor_)));
            break;
        case Drag::Orbit:
            camera.orbit(kOrbitPerPixel * pixels.x, kOrbitPerPixel * pixels.y);
            break;
        case Drag::Pan:
            camera.pan(pixels, mouse.viewport.y);
            break;
        case Drag::None:
            break;
    }
    if (!holding() && !mouse.elsewhere && mouse.wheel != 0) camera.zoom(mouse.wheel, mouse.cursor, mouse.viewport);
    cursor_ = mouse.cursor;
    buttonsUp_ = !anyButton;
}

}  // namespace touchstone::sandbox
