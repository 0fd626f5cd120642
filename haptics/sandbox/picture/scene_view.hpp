#pragma once
// A scene and what its tick does, as a frame for the renderer.
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/view/renderer.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/sandbox/picture/display_options.hpp"
#include "haptics/sandbox/picture/scene_overlays.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// Contacts lie between the bodies: how strongly they and the arrows show through what hides them.
inline constexpr float kHiddenOpacity = 0.65f;

/// Directions from which a scene is seen by name: front, back, left, right, top, bottom, and contact, near where the
/// bodies touch.
struct SceneDirection {
    std::string_view name;
    float yaw, pitch;  ///< radians
};
std::span<const SceneDirection> sceneDirections();
inline constexpr std::string_view kContactView = "contact";
/// Nothing for the empty name and those known, else one sentence.
std::string checkView(std::string_view name);

/// Brings the points into the middle of the picture, seen from the camera's direction. Without points it stays.
void fitPoints(engine::OrbitCamera& camera, const std::vector<glm::vec3>& points, float aspect);

/// Holds the GPU's copy of a scene's meshes. The scene outlives it; Visibility, where nodes stand and where the world
/// has them may change meanwhile, and nothing else.
class SceneView {
  public:
    SceneView(engine::Renderer& renderer, const HapticScene& scene);

    /// Appends the scene as it stands after a tick to `frame`, seen with frame.camera. `record` null: the tool stands
    /// where its node does, without contacts or arrows.
    void fill(engine::Frame& frame, const TickRecord* record, const Settings& settings, const DisplayOptions& options);
    /// Notes a tick for the trace; fill() does so with its own.
    void follow(const TickRecord& record);

    /// Brings all visible parts into view, the tool at this pose (null: where its node stands), from the camera's
    /// direction.
    void fit(engine::OrbitCamera& camera, const Pose* X_WT, float aspect) const;
    /// The same from the front and above, turned so that one sees between tool and obstacles.
    engine::OrbitCamera look(const Pose* X_WT, float aspect) const;
    /// A view by name, which checkView() knows; look() for the empty name. Null: the tool stands where it starts.
    engine::OrbitCamera look(std::string_view name, const TickRecord* record, const Settings& settings, float aspect);

  private:
    struct Part {
        engine::Entity node;
        engine::DrawItem item;  ///< model: where the file has it
        Role role = Role::Visual;
        int material = -1;          ///< of the scene
        bool moves = false;         ///< belongs to the tool's subtree
        glm::vec3 low{0}, high{0};  ///< bounding box in its own frame
    };
    /// The part as it looks now, with the tool at that pose.
    engine::DrawItem itemOf(const Part& part, const Pose* X_WT) const;
    /// Corners of the bounding boxes of all visible parts that move, that do not, or both; metres.
    std::vector<glm::vec3> corners(const Pose* X_WT, bool moving, bool fixed) const;
    void addParts(engine::Frame& frame, const TickRecord* record, const DisplayOptions& options) const;
    void addGhost(engine::Frame& frame, const Pose& X_WT, glm::vec3 tint, float share, float alpha) const;
    void addGoal(engine::Frame& frame, const Pose& X_WT, bool meshShown) const;
    void addGauge(engine::Frame& frame, const Pose& X_WT) const;
    /// Plane for Frame::section through a point, mm, the half towards the viewer cut away.
    glm::vec4 section(const engine::OrbitCamera& camera, const Vec3& p_W, const DisplayOptions& options) const;
    SceneOverlays* overlays();  ///< null without a world

    const HapticScene& scene_;
    std::vector<Part> parts_;
    std::unique_ptr<SceneOverlays> overlays_;
    std::optional<Vec3> cutAt_;  ///< where the section goes through, mm; follows the contacts slowly
    double reach_ = 50;          ///< ρ, mm
    float floor_ = 0;            ///< height of the grid, metres
};

/// A picture of a tick, drawn without display.
struct ScenePicture {
    DisplayOptions display = {};
    std::string view = {};  ///< as SceneView::look()
    int width = 1280, height = 800;
    std::span<const TickRecord> before = {};  ///< ticks whose way the trace shows
};

/// Throws std::runtime_error with one sentence when there is no OpenGL.
engine::Image renderScene(const HapticScene& scene, const TickRecord& record, const Settings& settings,
                          const ScenePicture& picture = {});

}  // namespace touchstone::sandbox
