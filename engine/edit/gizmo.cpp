#include "engine/edit/gizmo.hpp"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <string>
#include <vector>

#include "engine/scene/text.hpp"

namespace touchstone::engine {
namespace {

constexpr float kReach = 8;       // pixels within which a handle can be grabbed
constexpr float kMiddle = 0.14f;  // radius of the middle, as a fraction of the axis length
constexpr float kRing = 0.78f;    // radius of a ring, as a fraction of the axis length
constexpr float kEdgeOn = 0.2f;   // a ring seen flatter than this is turned by its tangent
constexpr float kHeadOn = 0.97f;  // an axis seen from its end cannot be dragged
constexpr double kSnapMeters = 1e-3, kSnapRad = 5 * glm::pi<double>() / 180;
constexpr int kRingPoints = 48;

bool moves(GizmoHandle h) { return h >= GizmoHandle::MoveX && h <= GizmoHandle::MoveZ; }
bool turns(GizmoHandle h) { return h >= GizmoHandle::TurnX; }
int axisOf(GizmoHandle h) {
    return turns(h) ? int(h) - int(GizmoHandle::TurnX) : moves(h) ? int(h) - int(GizmoHandle::MoveX) : -1;
}
GizmoHandle moveAlong(int axis) { return GizmoHandle(int(GizmoHandle::MoveX) + axis); }
GizmoHandle turnAbout(int axis) { return GizmoHandle(int(GizmoHandle::TurnX) + axis); }

/// Axis k of the handles in the scene.
glm::dvec3 axisOf(const GizmoPlace& place, int k) {
    glm::dvec3 axis(0);
    axis[k] = 1;
    return place.ownAxes ? place.body.rotation * axis : axis;
}

/// The handles as the camera sees them now.
struct Figure {
    const OrbitCamera& camera;
    glm::vec2 viewport;
    glm::vec3 pivot;
    std::array<glm::vec3, 3> axes;
    float length = 0;  // of an axis, meters

    Figure(const OrbitCamera& camera_, glm::vec2 viewport_, const GizmoPlace& place)
        : camera(camera_), viewport(viewport_), pivot(place.worldPivot()) {
        for (int k = 0; k < 3; ++k) {
            axes[k] = glm::vec3(axisOf(place, k));
        }
        length = place.size * std::abs(camera.metersPerPixel(pivot, viewport.y));
    }

    bool visible() const { return glm::dot(pivot - camera.eye(), camera.forward()) > 0; }
    glm::vec3 sight() const { return glm::normalize(pivot - camera.eye()); }
    bool headOn(int axis) const { return std::abs(glm::dot(axes[axis], sight())) > kHeadOn; }
    bool edgeOn(int axis) const { return std::abs(glm::dot(axes[axis], sight())) < kEdgeOn; }
    glm::vec2 screen(const glm::vec3& p) const { return camera.project(p, viewport).value_or(glm::vec2(-1e6f)); }

    /// The half of a ring that faces the viewer, or the whole ring if seen along its axis.
    std::vector<glm::vec2> ring(int axis) const {
        const glm::vec3 n = axes[axis];
        const bool whole = std::abs(glm::dot(n, sight())) > 0.9f;
        std::vector<glm::vec2> points;
        const glm::vec3 nearest = whole ? axes[(axis + 1) % 3] : glm::normalize(-sight() + glm::dot(n, sight()) * n);
        const glm::vec3 beside = glm::cross(n, nearest);
        const float half = whole ? glm::pi<float>() : glm::half_pi<float>();
        for (int i = 0; i <= kRingPoints; ++i) {
            const float angle = half * (2 * float(i) / kRingPoints - 1);
            points.push_back(screen(pivot + kRing * length * (std::cos(angle) * nearest + std::sin(angle) * beside)));
        }
        return points;
    }
};

float distanceTo(glm::vec2 p, glm::vec2 a, glm::vec2 b) {
    const glm::vec2 ab = b - a;
    const float length2 = glm::dot(ab, ab);
    const float t = length2 > 0 ? std::clamp(glm::dot(p - a, ab) / length2, 0.f, 1.f) : 0.f;
    return glm::length(p - a - t * ab);
}

}  // namespace

void Gizmo::reset() {
    handle_ = GizmoHandle::None;
    dragging_ = false;
}

GizmoHandle Gizmo::hit(const MouseFrame& mouse, const OrbitCamera& camera, const GizmoPlace& place) const {
    const Figure figure(camera, mouse.viewport, place);
    if (!figure.visible()) return GizmoHandle::None;
    const glm::vec2 middle = figure.screen(figure.pivot);
    if (glm::length(mouse.cursor - middle) < kMiddle * place.size) return GizmoHandle::MovePlane;
    GizmoHandle nearest = GizmoHandle::None;
    float distance = kReach;
    const auto consider = [&](GizmoHandle handle, float d) {
        if (d < distance) {
            distance = d;
            nearest = handle;
        }
    };
    for (int k = 0; k < 3; ++k) {
        if (!figure.headOn(k))
            consider(moveAlong(k),
                     distanceTo(mouse.cursor, middle, figure.screen(figure.pivot + figure.length * figure.axes[k])));
        const std::vector<glm::vec2> ring = figure.ring(k);
        for (std::size_t i = 1; i < ring.size(); ++i)
            consider(turnAbout(k), distanceTo(mouse.cursor, ring[i - 1], ring[i]));
    }
    return nearest;
}

glm::dvec3 Gizmo::measure(const MouseFrame& mouse, const OrbitCamera& camera) const {
    const Figure figure(camera, mouse.viewport, start_);
    const int k = axisOf(handle_);
    if (k < 0) return camera.onViewPlane(mouse.cursor, mouse.viewport, figure.pivot);
    const Ray ray = camera.ray(mouse.cursor, mouse.viewport);
    const glm::vec3 axis = figure.axes[k];
    if (moves(handle_)) {
        // The point of the axis nearest to the cursor's ray.
        const glm::vec3 w = figure.pivot - ray.origin;
        const float b = glm::dot(axis, ray.direction), d = glm::dot(axis, w), e = glm::dot(ray.direction, w);
        const float s = (b * e - d) / std::max(1 - b * b, 1e-4f);
        return {s, 0, 0};
    }
    if (!figure.edgeOn(k))
        if (const auto p = intersectPlane(ray, figure.pivot, axis)) {
            const glm::vec3 a = figure.axes[(k + 1) % 3], b = figure.axes[(k + 2) % 3], d = *p - figure.pivot;
            return {std::atan2(double(glm::dot(d, b)), double(glm::dot(d, a))), 0, 0};
        }
    // Seen edge-on: along the ring's near side.
    const glm::vec3 tangent = glm::cross(axis, -figure.sight());
    const glm::vec3 p = camera.onViewPlane(mouse.cursor, mouse.viewport, figure.pivot);
    return {glm::dot(p - figure.pivot, tangent) / (kRing * figure.length), 0, 0};
}

std::optional<RigidPart> Gizmo::update(const MouseFrame& mouse, const OrbitCamera& camera, const GizmoPlace& place,
                                       bool snap) {
    if (dragging_ && !mouse.left) reset();
    if (!dragging_) {
        const bool other = mouse.elsewhere || mouse.right || mouse.middle || (mouse.left && !buttonUp_);
        handle_ = other ? GizmoHandle::None : hit(mouse, camera, place);
        if (handle_ != GizmoHandle::None && mouse.left) {
            dragging_ = true;
            start_ = place;
            from_ = measure(mouse, camera);
            lastAngle_ = from_.x;
            turned_ = 0;
            moved_ = {};
        }
    }
    buttonUp_ = !mouse.left;
    if (!dragging_) return std::nullopt;

    const glm::dvec3 now = measure(mouse, camera);
    RigidPart body = start_.body;
    const int k = axisOf(handle_);
    if (turns(handle_)) {
        turned_ += std::remainder(now.x - lastAngle_, 2 * glm::pi<double>());  // past half a turn it goes on
        lastAngle_ = now.x;
        const double angle = snap ? kSnapRad * std::round(turned_ / kSnapRad) : turned_;
        moved_ = {angle, 0, 0};
        const glm::dvec3 pivot = start_.worldPivot();
        const glm::dquat turn = glm::angleAxis(angle, axisOf(start_, k));
        body.translation = pivot + turn * (body.translation - pivot);
        body.rotation = glm::normalize(turn * body.rotation);
        return body;
    }
    const glm::dvec3 d = now - from_;
    const auto stepped = [&](double meters) { return snap ? kSnapMeters * std::round(meters / kSnapMeters) : meters; };
    moved_ = k < 0 ? glm::dvec3(stepped(d.x), stepped(d.y), stepped(d.z)) : stepped(d.x) * axisOf(start_, k);
    body.translation += moved_;
    return body;
}

void Gizmo::draw(ImDrawList& list, const OrbitCamera& camera, glm::vec2 corner, glm::vec2 viewport,
                 const GizmoPlace& place) const {
    const Figure figure(camera, viewport, place);
    if (!figure.visible()) return;
    constexpr std::array kColors{IM_COL32(235, 82, 82, 255), IM_COL32(116, 200, 84, 255), IM_COL32(90, 150, 245, 255)};
    constexpr ImU32 kHeld = IM_COL32(255, 220, 90, 255), kDark = IM_COL32(0, 0, 0, 110);
    const auto at = [&](glm::vec2 p) { return ImVec2(corner.x + p.x, corner.y + p.y); };
    const glm::vec2 middle = figure.screen(figure.pivot);
    const auto shown = [&](GizmoHandle handle) { return !dragging_ || handle == handle_; };

    for (int k = 0; k < 3; ++k) {
        if (!shown(turnAbout(k))) continue;
        const bool held = handle_ == turnAbout(k);
        std::vector<ImVec2> points;
        for (const glm::vec2& p : figure.ring(k)) points.push_back(at(p));
        list.AddPolyline(points.data(), int(points.size()), kDark, ImDrawFlags_None, held ? 6.f : 4.5f);
        list.AddPolyline(points.data(), int(points.size()), held ? kHeld : kColors[k], ImDrawFlags_None,
                         held ? 3.5f : 2.f);
    }
    for (int k = 0; k < 3; ++k) {
        if (figure.headOn(k) || !shown(moveAlong(k))) continue;
        const bool held = handle_ == moveAlong(k);
        const ImU32 color = held ? kHeld : kColors[k];
        const glm::vec2 tip = figure.screen(figure.pivot + figure.length * figure.axes[k]);
        const glm::vec2 along = glm::normalize(tip - middle), across(-along.y, along.x);
        const float head = 0.16f * place.size;
        const glm::vec2 neck = tip - head * along;
        list.AddLine(at(middle), at(neck), kDark, held ? 6.f : 5.f);
        list.AddLine(at(middle), at(neck), color, held ? 4.f : 2.5f);
        list.AddTriangleFilled(at(tip), at(neck + 0.4f * head * across), at(neck - 0.4f * head * across), color);
        const char label[] = {"XYZ"[k], 0};
        const ImVec2 size = ImGui::CalcTextSize(label);
        const ImVec2 end = at(tip + 0.12f * place.size * along);
        list.AddCircleFilled(end, 0.6f * size.y, kDark);
        list.AddText({end.x - 0.5f * size.x, end.y - 0.5f * size.y}, color, label);
    }
    if (shown(GizmoHandle::MovePlane)) {
        const bool held = handle_ == GizmoHandle::MovePlane;
        list.AddCircleFilled(at(middle), kMiddle * place.size, IM_COL32(255, 255, 255, held ? 130 : 60));
        list.AddCircle(at(middle), kMiddle * place.size, held ? kHeld : IM_COL32(255, 255, 255, 220), 0, 2);
    }
    if (!dragging_) return;
    const glm::dvec3 mm = 1000. * moved_;
    const std::string text = turns(handle_)
                                 ? formatted("%+.1f° about %c", glm::degrees(moved_.x), "xyz"[axisOf(handle_)])
                                 : formatted("%+.2f, %+.2f, %+.2f mm", mm.x, mm.y, mm.z);
    const ImVec2 size = ImGui::CalcTextSize(text.c_str());
    const ImVec2 low = at(middle + glm::vec2(-0.5f * size.x, 1.2f * place.size));
    list.AddRectFilled({low.x - 6, low.y - 3}, {low.x + size.x + 6, low.y + size.y + 3}, IM_COL32(15, 17, 20, 220), 4);
    list.AddText(low, IM_COL32(255, 255, 255, 255), text.c_str());
}

std::optional<glm::vec2> Gizmo::grip(GizmoHandle handle, const OrbitCamera& camera, glm::vec2 viewport,
                                     const GizmoPlace& place) {
    const Figure figure(camera, viewport, place);
    if (!figure.visible() || handle == GizmoHandle::None) return std::nullopt;
    const int k = axisOf(handle);
    if (moves(handle)) {
        if (figure.headOn(k)) return std::nullopt;
        return figure.screen(figure.pivot + 0.9f * figure.length * figure.axes[k]);
    }
    if (!turns(handle)) return figure.screen(figure.pivot);
    // Where no other handle is nearer.
    Gizmo probe;
    MouseFrame mouse{.cursor = {}, .viewport = viewport};
    for (const glm::vec2& p : figure.ring(k)) {
        mouse.cursor = p;
        if (probe.hit(mouse, camera, place) == handle) return p;
    }
    return std::nullopt;
}

}  // namespace touchstone::engine
