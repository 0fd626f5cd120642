#pragma once
// A scene and what its tick does, as a frame for the renderer.
#include <filesystem>
#include <memory>
#include <vector>

#include "engine/view/renderer.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/system/contact_finder.hpp"
#include "haptics/system/scene_world.hpp"

namespace touchstone::system {

/// What is drawn besides the meshes whose Visibility is on.
struct DisplayOptions {
    bool ghost = true;     ///< the device's pose, where it is apart from the tool
    bool contacts = true;  ///< points and normals
    bool arrows = true;    ///< force and torque on the hand at C
    bool goal = true;      ///< where the tool is to come to rest
    bool grid = true;
    bool cut = false;            ///< cut the scene open at C, towards the viewer
    int toolLevel = -1;          ///< sphere-tree level drawn over the tool: 0 leaves, -1 none
    int obstacleLevel = -1;      ///< likewise over the obstacles
    double contactMargin = 0.2;  ///< mm: pairs this near are shown as contacts
};

/// Contacts lie between the bodies: how strongly they and the arrows show through what hides them.
inline constexpr float kHiddenOpacity = 0.65f;

/// Length in the picture, in units of the tool's reach, of an arrow for a force in N: proportional while small, and
/// never longer than 1.8, so that it stays in the picture. A torque is shown as the force that makes it at the reach.
double arrowLength(double newtons);

/// Colour of a sphere of a tree: neighbours differ a little in hue and brightness, so that each can be seen.
glm::vec4 sphereColor(bool tool, int level, int index);

/// Brings the points into the middle of the picture, seen from the camera's direction. Without points it stays.
void fitPoints(engine::OrbitCamera& camera, const std::vector<glm::vec3>& points, float aspect);

/// Holds the GPU's copy of a scene's meshes. The scene outlives it; Visibility, where nodes stand and the
/// world may change meanwhile, and nothing else.
class SceneView {
  public:
    SceneView(engine::Renderer& renderer, const HapticScene& scene);

    /// Appends the scene as it stands after a tick to `frame`, seen with frame.camera. `record` null: the tool stands
    /// where its node does, without contacts or arrows.
    void fill(engine::Frame& frame, const TickRecord* record, const Settings& settings, const DisplayOptions& options);

    /// Brings all visible parts into view, the tool at this pose (null: where its node stands), from the camera's
    /// direction.
    void fit(engine::OrbitCamera& camera, const Pose* X_WT, float aspect) const;
    /// The same from the front and above, turned so that one sees between tool and obstacles.
    engine::OrbitCamera look(const Pose* X_WT, float aspect) const;

  private:
    struct Part {
        engine::Entity node;
        engine::DrawItem item;  ///< model: where the file has it
        Role role = Role::Visual;
        bool moves = false;         ///< belongs to the tool's subtree
        glm::vec3 low{0}, high{0};  ///< bounding box in its own frame
    };
    glm::mat4 modelAt(const Part& part, const Pose* X_WT) const;
    /// Corners of the bounding boxes of all visible parts that move, that do not, or both; metres.
    std::vector<glm::vec3> corners(const Pose* X_WT, bool moving, bool fixed) const;
    void addParts(engine::Frame& frame, const TickRecord* record, const DisplayOptions& options) const;
    void addGhost(engine::Frame& frame, const Pose& X_WT, glm::vec3 tint, float share, float alpha) const;
    void addContacts(engine::Frame& frame, const TickRecord& record, const Settings& settings, double margin);
    void addArrows(engine::Frame& frame, const TickRecord& record) const;
    void addSpheres(engine::Frame& frame, const SphereTree& tree, const Pose& X_WB, int level, bool tool) const;

    const HapticScene& scene_;
    std::vector<Part> parts_;
    glm::dmat4 toolFromWorld_{1};              ///< inverse of the tool node's rigid matrix in the file
    std::unique_ptr<ContactFinder> contacts_;  ///< null without a world
    std::shared_ptr<const World> contactWorld_;
    double reach_ = 50;  ///< ρ, mm
    float floor_ = 0;    ///< height of the grid, metres
};

/// Draws a tick of a scene into a PNG file, without display. Throws std::runtime_error with one sentence when there is
/// no OpenGL or the file cannot be written.
void renderScreenshot(const HapticScene& scene, const TickRecord& record, const Settings& settings,
                      const DisplayOptions& options, const std::filesystem::path& file, int width, int height);

}  // namespace touchstone::system
