#pragma once
// The selected node in the 3D view: selected by a click, outlined by a box, moved and turned by handles.
#include "engine/edit/gizmo.hpp"
#include "engine/edit/pick.hpp"
#include "engine/edit/scene_edit.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// Tool pose and device pose. While nothing runs, both are the start pose of the tool.
struct ToolPoses {
    Pose X_WT, X_WT_device;
    bool running = false;
};

class Selection {
  public:
    /// Result of a drag of the handles.
    struct Result {
        std::optional<engine::SceneEdit> edit;  ///< at the end of the drag: new pose of the node
        std::optional<Pose> hand;               ///< during the drag of a running tool: target pose of the hand
    };

    engine::Entity node() const { return node_; }
    bool dragging() const { return gizmo_.dragging(); }
    /// The cursor is on a handle or holds one.
    bool busy() const { return gizmo_.handle() != engine::GizmoHandle::None; }
    /// Null clears the selection.
    void select(engine::Entity node);
    /// Selects what the ray of a click hits: the nearest ancestor with a role, else the node with the mesh. A miss
    /// clears the selection.
    void click(const HapticScene& scene, const ToolPoses& tool, const engine::Ray& ray);
    /// Selects the node of the same index in a reloaded scene.
    void moveTo(const engine::Scene& before, const engine::Scene& after);

    /// Call once a frame, before other uses of the mouse. A dragged node is moved in `scene` at once; the result at the
    /// end of the drag makes the move an edit.
    Result update(const engine::MouseFrame& mouse, const engine::OrbitCamera& camera, HapticScene& scene,
                  const ToolPoses& tool, bool ownAxes, float size, bool snap);
    /// Cancels a drag and restores the node.
    void cancel(HapticScene& scene);

    /// Draws box and handles. `corner`: upper-left corner of the viewport on the screen.
    void draw(ImDrawList& list, const engine::OrbitCamera& camera, glm::vec2 corner, glm::vec2 viewport,
              const HapticScene& scene, const ToolPoses& tool) const;
    /// Corners of the node's bounding box in the scene, meters; empty without meshes.
    std::vector<glm::vec3> corners(const HapticScene& scene, const ToolPoses& tool) const;
    /// Pose of the handles; nothing if no node is selected, or a part of a running tool.
    const std::optional<engine::GizmoPlace>& handles() const { return place_; }

  private:
    engine::Entity node_;
    std::optional<engine::NodeBox> box_;  ///< computed when first needed
    engine::Gizmo gizmo_;
    std::optional<engine::GizmoPlace> place_;
    std::optional<engine::LocalTransform> before_;  ///< transform of the dragged node before the drag
};

}  // namespace touchstone::sandbox
