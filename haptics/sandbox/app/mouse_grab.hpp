#pragma once
// Mouse input in the 3D view: on the tool it moves the hand, elsewhere the camera.
#include <glm/glm.hpp>
#include <optional>

#include "engine/view/camera.hpp"
#include "engine/view/mouse_frame.hpp"
#include "haptics/loop/world.hpp"
#include "haptics/math/rigid.hpp"

namespace touchstone::sandbox {

/// First intersection of a ray (meters) with the tool at X_WT, scene frame, mm; nothing if it misses: of a closed mesh,
/// else of the leaves of the sphere tree.
std::optional<Vec3> pickTool(const World& world, const Pose& X_WT, const engine::Ray& ray);

/// The tool as currently shown.
struct GrabTool {
    const World* world = nullptr;
    Pose X_WT;         ///< tool pose: what is drawn and picked
    Pose X_WT_device;  ///< device pose: where the first grab starts
};

/// State machine of dragging, updated once a frame. On the tool, left drag translates in the view plane, and the wheel
/// translates along the cursor's ray. Right or Shift+left drag turns about C on the view's axes; the wheel then turns
/// about the line of sight. Elsewhere, left drag orbits, right, middle or Shift+left drag pans, and the wheel zooms.
class MouseGrab {
  public:
    /// Moves `camera` or the target pose. `tool`: null if there is no tool to grab.
    void update(const engine::MouseFrame& mouse, engine::OrbitCamera& camera, const GrabTool* tool);

    /// The left button was pressed and released at the same place in the view.
    bool clicked() const { return clicked_; }
    bool holding() const { return drag_ == Drag::Move || drag_ == Drag::Turn; }
    /// The cursor is on the tool or holds it.
    bool hovering() const { return hovering_; }
    /// Target pose of the hand, scene frame. It is kept after release, so that the next grab continues from there.
    const std::optional<Pose>& wanted() const { return wanted_; }
    /// Target of the held point, mm, scene frame.
    const Vec3& anchor() const { return anchor_; }
    /// The held point in the tool's frame. It lags behind anchor() when the tool is blocked.
    const Vec3& heldPoint() const { return held_T_; }
    /// Releases the tool and forgets the target pose, e.g. after a restart.
    void reset();

  private:
    enum class Drag { None, Move, Turn, Orbit, Pan };

    void begin(const engine::MouseFrame& mouse, const engine::OrbitCamera& camera, const GrabTool* tool);
    void move(const engine::MouseFrame& mouse, const engine::OrbitCamera& camera);
    void turn(const Vec3& w, const Vec3& p_TC);

    Drag drag_ = Drag::None;
    bool buttonsUp_ = true;  ///< no button was down: a drag starts with a press inside the view, not in a panel
    bool hovering_ = false;
    bool clicked_ = false;
    std::optional<glm::vec2> pressed_;  ///< where the left button was pressed; empty once the cursor has moved
    glm::vec2 cursor_{0};
    Vec3 anchor_ = Vec3::Zero(), held_T_ = Vec3::Zero();
    std::optional<Pose> wanted_;
};

}  // namespace touchstone::sandbox
