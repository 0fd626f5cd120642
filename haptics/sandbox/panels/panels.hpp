#pragma once
// The panels. Each is a function that draws `view` into the current ImGui window and changes the objects it is given.
// Everything else that the user requests is returned in PanelRequests. ItemRects may be null everywhere.
#include <imgui.h>

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/ui/panel_layout.hpp"
#include "engine/ui/widgets.hpp"
#include "haptics/sandbox/measure/fit_check.hpp"
#include "haptics/sandbox/picture/scene_view.hpp"
#include "haptics/sandbox/scene/marking.hpp"
#include "haptics/sandbox/session/session.hpp"

namespace touchstone::sandbox {

/// What the user requested in a frame.
struct PanelRequests {
    std::optional<std::filesystem::path> open;
    std::optional<std::string> device;  ///< NAME or NAME:FILE
    std::optional<Workspace> workspace;
    bool reconnect = false, initializeDevice = false, alignWithView = false;
    std::vector<engine::SceneEdit> edits;  ///< of the scene shown
    std::vector<Marking> markings;         ///< of the shown scene: roles, trees and friction
    std::optional<std::filesystem::path> save;
    bool saveSettings = false;                   ///< include the settings in `save`
    std::optional<std::filesystem::path> study;  ///< folder of a study to make
    std::optional<engine::StandardView> view;    ///< new direction of the camera
    std::string refusal;                         ///< why a typed value was rejected; empty: none was
    bool reload = false, restart = false, stopOrEngage = false, cancelOpening = false, quit = false;
    bool discard = false;  ///< discard unsaved changes without asking the user
    bool frameCamera = false, frameSelection = false;
    bool undo = false, redo = false, copyCommand = false;
    bool record = false;  ///< start or stop recording
    bool checkFit = false;
    engine::Folds fold;                ///< panels to fold, or to unfold if they are folded
    bool setGoal = false;              ///< the goal is where the tool is
    bool recordDemonstration = false;  ///< start or finish
    bool replayDemonstration = false;

    /// Whether the requests close the scene shown: reload it, open another one, or quit.
    bool leaves() const { return open || reload || quit; }
};

/// Color of text that reports a problem.
inline const ImVec4 kAttentionColor{1.00f, 0.78f, 0.35f, 1};

using PathInput = std::array<char, 1024>;

/// Name of a node as shown in the panels.
std::string nodeText(const engine::Scene& scene, engine::Entity node);

struct ScenePanelState {
    engine::Entity selected;
    float below = 0;  ///< height below the list of nodes, measured in the previous frame
};

/// Draws the nodes with visibility and roles, the display switches, and the levels of the sphere trees; of trees only
/// what is touched by spheres in this geometry of the tick.
void drawScenePanel(HapticScene& scene, Geometry geometry, DisplayOptions& display, ScenePanelState& state,
                    engine::ItemRects* items);

struct InspectorState {
    engine::Entity node;                     ///< node that the other members refer to
    bool placing = false, choosing = false;  ///< pose or tree is being edited
    bool editingFriction = false, editingGoal = false;
    glm::dvec3 position{0}, angles{0};  ///< pose being edited: mm, degrees about x, y, z
    TreeOptions tree;                   ///< tree options being edited
    glm::dvec2 friction{0};             ///< static and dynamic friction being edited
    GoalRegion goal;                    ///< tolerances of the goal being edited
    bool ownAxes = false;               ///< the gizmo uses the node's axes
    bool naming = false;
    std::array<char, 128> name{};  ///< name being typed
};

/// Draws the selected node: name, pose, role, goal, friction, materials, and by what it is touched in this geometry of
/// the tick: its mesh, or its sphere tree with the tree's options. Pre: `node` is a node of the scene.
void drawInspector(HapticScene& scene, Geometry geometry, engine::Entity node, InspectorState& state,
                   PanelRequests& requests, engine::ItemRects* items);

/// Where an edit of the part's friction is written, and which other parts change with it. Pre: the part has friction.
std::string frictionHelp(const HapticScene& scene, engine::Entity part);

/// Draws a guide for assigning roles in a scene that lacks some. `selected` may be null.
void drawGuide(const HapticScene& scene, engine::Entity selected, PanelRequests& requests, engine::ItemRects* items);

/// Asks whether the scene has the wrong unit. Returns true once the user answered; `requests` then has the edits that
/// scale it, if it has.
bool drawUnitQuestion(const HapticScene& scene, const UnitQuestion& question, PanelRequests& requests,
                      engine::ItemRects* items);

struct HapticsPanelState {
    double strength = 1;  ///< stiffness of the mouse's hand, relative to its default
};

/// Draws pause, reset, the check of the fit, the presets (derived from `scene`, the scene's own settings) and the
/// tunable settings. Returns true when `settings` changed; they then pass checkSettings().
bool drawHapticsPanel(const Settings& scene, const Background<FitCheck>& fit, Settings& settings,
                      HapticsPanelState& state, PanelRequests& requests, engine::ItemRects* items);

/// Draws whether the tool fits, and a button that takes the settings that the check advises. Returns true when
/// `settings` changed.
bool drawFit(const Background<FitCheck>& fit, Settings& settings, PanelRequests& requests, engine::ItemRects* items);

struct DevicePanelView {
    const std::string& device;
    const DeviceFacts& facts;
    const Settings& settings;
    const DeviceControl* control = nullptr;  ///< null: only `trouble` is shown
    const std::string& trouble;              ///< why the selected device did not start; empty: it did
};
struct DevicePanelState {
    std::optional<Workspace> edited;  ///< value being dragged or typed
    bool asksConsent = false;         ///< the question whether the device may move is open
};

/// Draws the state of a hardware device, its gains and limits at the hand, and its workspace mapping.
void drawDevicePanel(const DevicePanelView& view, DevicePanelState& state, PanelRequests& requests,
                     engine::ItemRects* items);

/// Draws all messages since the window opened, newest last, with a button that copies them.
void drawLogPanel(const std::vector<Message>& messages, engine::ItemRects* items);

struct MenuView {
    const std::vector<std::filesystem::path>& scenes;  ///< scenes found in the scene folders
    const std::vector<std::filesystem::path>& recent;  ///< recent scenes, newest first
    const std::filesystem::path& file;                 ///< of the scene shown
    const std::string& device;
    bool running = false, hasScene = false, hasDemonstration = false, hasSelection = false;
    bool canUndo = false, canRedo = false, recording = false;
    bool recordingDemonstration = false;
    engine::Folds folded;
};
struct MenuState {
    bool panels = true;  ///< show all panels
    /// Dialogs to open in this frame; the help closes if it is open.
    bool openDialog = false, replayDialog = false, helpDialog = false, saveDialog = false, addDialog = false,
         leaveDialog = false, studyDialog = false;
    PanelRequests leaving;  ///< requests that the "unsaved changes" dialog asks about
    PathInput openPath{}, replayPath{}, savePath{}, addPath{}, studyPath{};
    bool saveSettings = true;
    Role addRole = Role::Obstacle;
};

/// Draws the menu bar.
void drawMenuBar(const MenuView& view, MenuState& state, DisplayOptions& display, PanelRequests& requests,
                 engine::ItemRects* items);
/// Begins a dialog in the middle of the window, and returns whether it is open. It opens on request; Escape or a click
/// outside closes it.
bool beginDialog(const char* title, bool& open);
/// Draws the dialogs requested in `state` except the one that opens a scene, each in its own window. Call after the
/// panels: a window that appears after a dialog would close it.
void drawDialogs(const MenuView& view, MenuState& state, PanelRequests& requests, engine::ItemRects* items);

/// Draws the progress of opening a scene, with a cancel button, in its own window.
void drawOpening(const OpeningProgress& progress, PanelRequests& requests, engine::ItemRects* items);

}  // namespace touchstone::sandbox
