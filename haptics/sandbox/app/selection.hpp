#pragma once
// The selected node in the picture: chosen by a click, framed by a box, moved and turned by handles.
#include "engine/edit/gizmo.hpp"
#include "engine/edit/pick.hpp"
#include "engine/edit/scene_edit.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// Where the tool is, and where its device wants it; both at its start while nothing runs.
struct ToolPoses {
    Pose X_WT, X_WT_device;
    bool running = false;
};

class Selection {
  public:
    /// What a drag of the handles asks for.
    struct Wish {
        std::optional<engine::SceneEdit> edit;  ///< at its end: another place of the node
        std::optional<Pose> hand;               ///< of a running tool, during the drag: where the hand is to go
    };

    engine::Entity node() const { return node_; }
    bool dragging() const { return gizmo_.dragging(); }
    /// The cursor is on a handle, or holds one.
    bool busy() const { return gizmo_.handle() != engine::GizmoHandle::None; }
    /// Null selects nothing.
    void select(engine::Entity node);
    /// What a click hits: the node with a role that it belongs to, else the node with the mesh; nothing selects
    /// nothing.
    void click(const HapticScene& scene, const ToolPoses& tool, const engine::Ray& ray);
    /// The same node, by its index, in a scene that was opened again.
    void moveTo(const engine::Scene& before, const engine::Scene& after);

    /// Once a frame, before the mouse does anything else. While a node is dragged it stands in `scene` where the
    /// handles have it; the wish at the end makes that a change.
    Wish update(const engine::MouseFrame& mouse, const engine::OrbitCamera& camera, HapticScene& scene,
                const ToolPoses& tool, bool ownAxes, float size, bool snap);
    /// Takes a drag back.
    void cancel(HapticScene& scene);

    /// Box and handles; `corner`: of the viewport on the screen.
    void draw(ImDrawList& list, const engine::OrbitCamera& camera, glm::vec2 corner, glm::vec2 viewport,
              const HapticScene& scene, const ToolPoses& tool) const;
    /// Corners of the node's box in the scene, metres; empty without meshes.
    std::vector<glm::vec3> corners(const HapticScene& scene, const ToolPoses& tool) const;
    /// Where the handles stand; nothing while nothing is selected, or a part of a running tool.
    const std::optional<engine::GizmoPlace>& handles() const { return place_; }

  private:
    engine::Entity node_;
    std::optional<engine::NodeBox> box_;  ///< found when first needed
    engine::Gizmo gizmo_;
    std::optional<engine::GizmoPlace> place_;
    std::optional<engine::LocalTransform> before_;  ///< where the dragged node stood
};

}  // namespace touchstone::sandbox
