#pragma once
// An orbit camera, and the geometry of pointing with a mouse. Lengths in meters, y is up.
// Pixels: x to the right, y down from the upper-left corner of the viewport, continuous (pixel centers at .5).
#include <glm/glm.hpp>
#include <optional>

namespace touchstone::engine {

struct Ray {
    glm::vec3 origin, direction;  ///< direction has unit length

    glm::vec3 at(float t) const { return origin + t * direction; }
};

enum class StandardView { Front, Back, Right, Left, Top, Bottom };

/// Looks at `target` from `distance` along yaw (about y, 0 looks along -z) and pitch (positive from above).
struct OrbitCamera {
    glm::vec3 target{0};
    float distance = 1;
    float yaw = 0, pitch = 0;  ///< radians; |pitch| stays below a right angle
    float fovY = 0.7f;         ///< vertical field of view, radians
    friend bool operator==(const OrbitCamera&, const OrbitCamera&) = default;

    /// Orbits about the target: positive yaw turns the visible scene to the right, positive pitch raises the eye.
    /// Radians.
    void orbit(float yawRadians, float pitchRadians);

    /// Moves target and eye in the view plane so that points at the target's depth follow a drag of `pixels`.
    void pan(glm::vec2 pixels, float viewportHeight);

    /// Multiplies the distance by exp(-steps/8): one wheel step nearer is about 12 percent.
    void zoom(float steps);

    /// Zooms toward the point under a pixel at the target's depth, which keeps its pixel.
    void zoom(float steps, glm::vec2 pixel, glm::vec2 viewport);

    /// Looks from a side of the scene with +y up; the front view looks along -z. Target and distance do not change.
    void look(StandardView view);

    /// Fits a sphere into a viewport of this aspect ratio (width / height), keeping the direction of view.
    void frame(glm::vec3 center, float radius, float aspect);

    glm::vec3 right() const;
    glm::vec3 up() const;
    glm::vec3 forward() const;  ///< unit vector from the eye to the target
    glm::vec3 eye() const;

    glm::mat4 view() const;
    glm::mat4 projection(float aspect) const;  ///< depth range follows the distance

    /// Ray from the eye through a pixel of a viewport of this size.
    Ray ray(glm::vec2 pixel, glm::vec2 viewport) const;

    /// Pixel of a world point; nothing if it lies behind the eye.
    std::optional<glm::vec2> project(glm::vec3 point, glm::vec2 viewport) const;

    /// Size of a pixel in meters at the depth of a point in front of the eye.
    float metersPerPixel(glm::vec3 point, float viewportHeight) const;

    /// Point under a pixel in the plane through `anchor` parallel to the view plane. The difference of two such points
    /// is the displacement of a mouse drag.
    glm::vec3 onViewPlane(glm::vec2 pixel, glm::vec2 viewport, glm::vec3 anchor) const;
};

/// First intersection of a ray with the plane through `point` with this normal; nothing if parallel or behind.
std::optional<glm::vec3> intersectPlane(const Ray& ray, glm::vec3 point, glm::vec3 normal);

}  // namespace touchstone::engine
