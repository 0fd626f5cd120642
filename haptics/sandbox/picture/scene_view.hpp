#pragma once
// Turns a scene and its current tick into a frame for the renderer.
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

/// Opacity of contacts and arrows behind other geometry. It is high because contacts lie between the bodies.
inline constexpr float kHiddenOpacity = 0.65f;

/// A named direction of view: front, back, left, right, top or bottom. kContactView names a close view of the contacts.
struct SceneDirection {
    std::string_view name;
    float yaw, pitch;  ///< radians
};
std::span<const SceneDirection> sceneDirections();
inline constexpr std::string_view kContactView = "contact";
/// Empty for a known view and for the empty name, else one sentence.
std::string checkView(std::string_view name);

/// Moves the camera, without turning it, so that the points fill the picture. Without points it does nothing.
void fitPoints(engine::OrbitCamera& camera, const std::vector<glm::vec3>& points, float aspect);

/// Holds the GPU copies of a scene's meshes. The scene must outlive it. Only visibility, node transforms, material
/// factors and poses in the world may change meanwhile.
class SceneView {
  public:
    SceneView(engine::Renderer& renderer, const HapticScene& scene);

    /// Appends the scene after a tick to `frame`, as seen by frame.camera. `record` null: the tool is drawn at the pose
    /// of its node, without contacts or arrows.
    void fill(engine::Frame& frame, const TickRecord* record, const Settings& settings, const DisplayOptions& options);
    /// Adds a tick to the trace; fill() does so with its own tick.
    void follow(const TickRecord& record);

    /// Moves the camera, without turning it, so that all visible parts are in view. `X_WT`: tool pose; null: the pose
    /// of its node.
    void fit(engine::OrbitCamera& camera, const Pose* X_WT, float aspect) const;
    /// The same for a motion of the tool, from its start to its end.
    void fit(engine::OrbitCamera& camera, const Motion& motion, float aspect) const;
    /// The same view from the front and above, turned so that the gap between tool and obstacles is visible.
    engine::OrbitCamera look(const Pose* X_WT, float aspect) const;
    /// A view by a name that checkView() accepts; the empty name gives look(). `record` null: the tool is at its start.
    engine::OrbitCamera look(std::string_view name, const TickRecord* record, const Settings& settings, float aspect);

  private:
    struct Part {
        engine::Entity node;
        engine::DrawItem item;  ///< its model matrix is that of the file
        Role role = Role::Visual;
        int material = -1;                     ///< index into the scene's materials
        bool moves = false;                    ///< belongs to the tool's subtree
        std::optional<std::size_t> body = {};  ///< of the world, see bodyOf()
        glm::vec3 low{0}, high{0};             ///< bounding box in the part's frame
    };
    /// The part in its current state, with the tool at X_WT.
    engine::DrawItem itemOf(const Part& part, const Pose* X_WT) const;
    /// Corners of the bounding boxes of the visible parts: moving, fixed, or both; meters.
    std::vector<glm::vec3> corners(const Pose* X_WT, bool moving, bool fixed) const;
    void addParts(engine::Frame& frame, const TickRecord* record, const DisplayOptions& options) const;
    int solidOf(std::size_t body) const;  ///< number of its items, DrawItem::body
    /// Uploads the surfaces that are colored by gap, if they have changed.
    void uploadGaps(const SceneOverlays& overlays);
    void addGhost(engine::Frame& frame, const Pose& X_WT, glm::vec3 tint, float share, float alpha) const;
    void addGoal(engine::Frame& frame, const Pose& X_WT, bool meshShown) const;
    void addGauge(engine::Frame& frame, const Pose& X_WT) const;
    /// Plane for Frame::section through a point (mm). The half toward the viewer is cut away.
    glm::vec4 section(const engine::OrbitCamera& camera, const Vec3& p_W, const DisplayOptions& options) const;
    SceneOverlays* overlays();  ///< null without a world

    engine::Renderer& renderer_;
    const HapticScene& scene_;
    std::vector<Part> parts_;
    std::vector<engine::GpuMesh> gapMeshes_;  ///< by body: in place of its parts; empty: none
    engine::GpuTexture gapColors_;
    int gapsNumber_ = 0;  ///< of the uploaded gaps
    std::unique_ptr<SceneOverlays> overlays_;
    std::optional<Vec3> cutAt_;  ///< point on the section, mm; follows the contacts slowly
    double reach_ = 50;          ///< ρ, mm
    float floor_ = 0;            ///< height of the grid, meters
};

/// Options of a picture that is rendered without a display.
struct ScenePicture {
    DisplayOptions display = {};
    std::string view = {};  ///< a name for SceneView::look()
    int width = 1280, height = 800;
    std::span<const TickRecord> before = {};  ///< earlier ticks for the trace
};

/// Throws std::runtime_error with one sentence when there is no OpenGL.
engine::Image renderScene(const HapticScene& scene, const TickRecord& record, const Settings& settings,
                          const ScenePicture& picture = {});

}  // namespace touchstone::sandbox
