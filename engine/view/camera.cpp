#include "engine/view/camera.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>

namespace touchstone::engine {

namespace {

constexpr float kMaxPitch = glm::half_pi<float>() - 0.01f;  // up() is undefined when looking straight down

}  // namespace

void OrbitCamera::orbit(float yawRadians, float pitchRadians) {
    yaw = std::remainder(yaw - yawRadians, glm::two_pi<float>());
    pitch = std::clamp(pitch + pitchRadians, -kMaxPitch, kMaxPitch);
}

void OrbitCamera::pan(glm::vec2 pixels, float viewportHeight) {
    const float scale = metresPerPixel(target, viewportHeight);
    target += scale * (pixels.y * up() - pixels.x * right());
}

void OrbitCamera::zoom(float steps) {
    constexpr float kNearest = 1e-4f, kFarthest = 1e4f;
    distance = std::clamp(distance * std::exp(-steps / 8), kNearest, kFarthest);
}

void OrbitCamera::zoom(float steps, glm::vec2 pixel, glm::vec2 viewport) {
    const glm::vec3 before = onViewPlane(pixel, viewport, target);
    zoom(steps);
    target += before - onViewPlane(pixel, viewport, target);
}

void OrbitCamera::look(StandardView view) {
    constexpr float kQuarter = glm::half_pi<float>();
    pitch = view == StandardView::Top ? kMaxPitch : view == StandardView::Bottom ? -kMaxPitch : 0;
    yaw = view == StandardView::Right  ? kQuarter
          : view == StandardView::Left ? -kQuarter
          : view == StandardView::Back ? 2 * kQuarter
                                       : 0;
}

void OrbitCamera::frame(glm::vec3 center, float radius, float aspect) {
    // The sphere touches the sides of the view cone of the narrower direction.
    const float halfY = fovY / 2;
    const float half = std::min(halfY, std::atan(aspect * std::tan(halfY)));
    target = center;
    distance = std::max(radius, 1e-4f) / std::sin(half);
}

glm::vec3 OrbitCamera::forward() const {
    return {-std::sin(yaw) * std::cos(pitch), -std::sin(pitch), -std::cos(yaw) * std::cos(pitch)};
}
glm::vec3 OrbitCamera::right() const { return {std::cos(yaw), 0, -std::sin(yaw)}; }
glm::vec3 OrbitCamera::up() const { return glm::cross(right(), forward()); }
glm::vec3 OrbitCamera::eye() const { return target - distance * forward(); }

glm::mat4 OrbitCamera::view() const { return glm::lookAt(eye(), target, up()); }

glm::mat4 OrbitCamera::projection(float aspect) const {
    return glm::perspective(fovY, aspect, distance / 50, distance * 100);
}

Ray OrbitCamera::ray(glm::vec2 pixel, glm::vec2 viewport) const {
    // Offset from the viewport's center, in units in which the view plane is at distance 1.
    const glm::vec2 offset = (pixel - 0.5f * viewport) * (2 * std::tan(fovY / 2) / viewport.y);
    return {eye(), glm::normalize(forward() + offset.x * right() - offset.y * up())};
}

std::optional<glm::vec2> OrbitCamera::project(glm::vec3 point, glm::vec2 viewport) const {
    const glm::vec3 d = point - eye();
    const float depth = glm::dot(d, forward());
    if (depth <= 0) return std::nullopt;
    const float scale = viewport.y / (2 * std::tan(fovY / 2) * depth);
    return 0.5f * viewport + scale * glm::vec2(glm::dot(d, right()), -glm::dot(d, up()));
}

float OrbitCamera::metresPerPixel(glm::vec3 point, float viewportHeight) const {
    return 2 * std::tan(fovY / 2) * glm::dot(point - eye(), forward()) / viewportHeight;
}

glm::vec3 OrbitCamera::onViewPlane(glm::vec2 pixel, glm::vec2 viewport, glm::vec3 anchor) const {
    const Ray through = ray(pixel, viewport);
    const glm::vec3 normal = forward();
    return through.at(glm::dot(anchor - through.origin, normal) / glm::dot(through.direction, normal));
}

std::optional<glm::vec3> intersectPlane(const Ray& ray, glm::vec3 point, glm::vec3 normal) {
    const float slope = glm::dot(ray.direction, normal);
    if (slope == 0) return std::nullopt;
    const float t = glm::dot(point - ray.origin, normal) / slope;
    if (!(t >= 0) || !std::isfinite(t)) return std::nullopt;
    return ray.at(t);
}

}  // namespace touchstone::engine
