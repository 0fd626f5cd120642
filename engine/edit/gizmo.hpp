#pragma once
// Handles around a body, to move and turn it with the mouse. Lengths in meters.
#include <array>
#include <optional>

#include "engine/scene/transforms.hpp"
#include "engine/view/camera.hpp"
#include "engine/view/mouse_frame.hpp"

struct ImDrawList;

namespace touchstone::engine {

/// What is grabbed: an axis, the view plane, or the ring about an axis.
enum class GizmoHandle { None, MoveX, MoveY, MoveZ, MovePlane, TurnX, TurnY, TurnZ };

/// Placement of the handles: about a pivot, along the axes of the scene or of the body; their size on the screen is
/// constant.
struct GizmoPlace {
    RigidPart body;        ///< rigid pose of the body in the scene
    glm::dvec3 pivot{0};   ///< in the body's frame
    bool ownAxes = false;  ///< the body's axes in place of the scene's
    float size = 90;       ///< length of an axis in pixels

    glm::dvec3 worldPivot() const { return body.translation + body.rotation * pivot; }
};

/// Call update() once a frame. Dragging an axis moves along it, the middle in the view plane, a ring turns about its
/// axis.
class Gizmo {
  public:
    /// The new pose of the body while a handle is dragged. `snap`: in steps of 1 mm and 5°.
    std::optional<RigidPart> update(const MouseFrame& mouse, const OrbitCamera& camera, const GizmoPlace& place,
                                    bool snap);
    /// The handle under the cursor or held.
    GizmoHandle handle() const { return handle_; }
    bool dragging() const { return dragging_; }
    /// Pose at the start of the drag.
    const RigidPart& start() const { return start_.body; }
    /// Ends the drag.
    void reset();

    /// Draws the handles and the amount of the drag; `corner`: of the viewport on the screen.
    void draw(ImDrawList& list, const OrbitCamera& camera, glm::vec2 corner, glm::vec2 viewport,
              const GizmoPlace& place) const;

    /// A point of the handle that can be grabbed, in pixels of the viewport; nothing if it is hidden.
    static std::optional<glm::vec2> grip(GizmoHandle handle, const OrbitCamera& camera, glm::vec2 viewport,
                                         const GizmoPlace& place);

  private:
    GizmoHandle hit(const MouseFrame& mouse, const OrbitCamera& camera, const GizmoPlace& place) const;
    /// Meters along the axis (x), radians about it (x), or a point of the view plane; a drag is the difference of two.
    glm::dvec3 measure(const MouseFrame& mouse, const OrbitCamera& camera) const;

    GizmoHandle handle_ = GizmoHandle::None;
    bool dragging_ = false, buttonUp_ = true;
    GizmoPlace start_;
    glm::dvec3 from_{0};
    double turned_ = 0, lastAngle_ = 0;
    glm::dvec3 moved_{0};
};

}  // namespace touchstone::engine
