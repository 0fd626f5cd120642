#pragma once
// The mouse over the scene: on the tool it moves the hand, elsewhere the camera.
#include <glm/glm.hpp>
#include <optional>

#include "engine/view/camera.hpp"
#include "engine/view/mouse_frame.hpp"
#include "haptics/collision/sphere_tree.hpp"
#include "haptics/math/rigid.hpp"

namespace touchstone::sandbox {

/// First point, scene frame in mm, where a ray (metres) meets a leaf of the tree at X_WT; nothing if it misses all.
std::optional<Vec3> pickTree(const SphereTree& tree, const Pose& X_WT, const engine::Ray& ray);

/// The tool as it is shown now.
struct GrabTool {
    const SphereTree* tree = nullptr;
    Pose X_WT;         ///< graphic tool: what is seen and picked
    Pose X_WT_device;  ///< where a first grab begins
};

/// Dragging, as a state machine fed once a frame. On the tool: left translates in the view plane, the wheel in depth
/// along the cursor's ray, right (or Shift and left) turns about C on the view's axes, the wheel then about the line of
/// sight. Elsewhere: left orbits, right, middle or Shift and left pan, the wheel zooms.
class MouseGrab {
  public:
    /// Moves `camera`, or the wanted pose of the tool. `tool` null: there is none to grab.
    void update(const engine::MouseFrame& mouse, engine::OrbitCamera& camera, const GrabTool* tool);

    /// The left button was let go where it was pressed, in the picture.
    bool clicked() const { return clicked_; }
    bool holding() const { return drag_ == Drag::Move || drag_ == Drag::Turn; }
    /// The cursor is on the tool, or holds it.
    bool hovering() const { return hovering_; }
    /// Pose the hand wants, scene frame; kept after release, so that a second grab goes on from there.
    const std::optional<Pose>& wanted() const { return wanted_; }
    /// The point of the tool that is held, mm, scene frame.
    const Vec3& anchor() const { return anchor_; }
    /// The same point in the tool's frame: where the tool is held back, it stays behind anchor().
    const Vec3& heldPoint() const { return held_T_; }
    /// Forgets the tool, e.g. after a restart.
    void reset();

  private:
    enum class Drag { None, Move, Turn, Orbit, Pan };

    void begin(const engine::MouseFrame& mouse, const engine::OrbitCamera& camera, const GrabTool* tool);
    void move(const engine::MouseFrame& mouse, const engine::OrbitCamera& camera);
    void turn(const Vec3& w, const Vec3& p_TC);

    Drag drag_ = Drag::None;
    bool buttonsUp_ = true;  ///< a drag begins with a press, not by sliding in from a panel with a button down
    bool hovering_ = false;
    bool clicked_ = false;
    std::optional<glm::vec2> pressed_;  ///< where the left button went down, until it moves on
    glm::vec2 cursor_{0};
    Vec3 anchor_ = Vec3::Zero(), held_T_ = Vec3::Zero();
    std::optional<Pose> wanted_;
};

}  // namespace touchstone::sandbox
