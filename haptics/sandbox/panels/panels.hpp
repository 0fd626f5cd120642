#pragma once
// The panels. Each is a function that draws into the current ImGui window what `view` says and changes what it is
// given; what it cannot do itself it asks for in PanelRequests. ItemRects may be null everywhere.
#include <imgui.h>

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/ui/widgets.hpp"
#include "haptics/sandbox/picture/scene_view.hpp"
#include "haptics/sandbox/scene/marking.hpp"
#include "haptics/sandbox/session/session.hpp"

namespace touchstone::sandbox {

/// What the user asked for in a frame.
struct PanelRequests {
    std::optional<std::filesystem::path> open;
    std::optional<std::string> device;  ///< NAME or NAME:FILE
    std::optional<Workspace> workspace;
    bool reconnect = false, alignWithView = false;
    std::vector<engine::SceneEdit> edits;  ///< of the scene that is shown
    std::vector<Marking> markings;         ///< likewise: roles and trees
    std::optional<std::filesystem::path> save;
    bool saveSettings = false;                 ///< along with it
    std::optional<engine::StandardView> view;  ///< the camera is to look from there
    std::string refusal;                       ///< a value that was typed and not accepted
    bool reload = false, restart = false, stopOrEngage = false, cancelOpening = false, quit = false;
    bool discard = false;  ///< changes that are not saved: else the user is asked before they are lost
    bool frameCamera = false, frameSelection = false;
    bool undo = false, redo = false, copyCommand = false;
    bool record = false;  ///< begin, or stop

    /// The scene that is shown gives way to its file, to another one, or to nothing.
    bool leaves() const { return open || reload || quit; }
};

/// Of text that says what is not as it should be.
inline const ImVec4 kAttentionColor{1.00f, 0.78f, 0.35f, 1};

using PathInput = std::array<char, 1024>;

/// Name of a node as the panels show it.
std::string nodeText(const engine::Scene& scene, engine::Entity node);

struct ScenePanelState {
    engine::Entity selected;
};

/// Entities with visibility and roles, what is drawn besides, and the levels of the sphere trees.
void drawScenePanel(HapticScene& scene, DisplayOptions& display, ScenePanelState& state, engine::ItemRects* items);

struct InspectorState {
    engine::Entity node;  ///< that the rest belongs to
    bool placing = false, choosing = false;
    glm::dvec3 position{0}, angles{0};  ///< while they are edited: mm, degrees about x, y, z
    TreeOptions tree;                   ///< while it is chosen
    bool ownAxes = false;               ///< of the gizmo
    bool naming = false;
    std::array<char, 128> name{};  ///< while it is typed
};

/// The node that is selected: name, place, role, sphere tree, looks. Pre: it is a node of the scene.
void drawInspector(HapticScene& scene, engine::Entity node, InspectorState& state, PanelRequests& requests,
                   engine::ItemRects* items);

/// What to do with a scene in which roles are missing. `selected` may be null.
void drawGuide(const HapticScene& scene, engine::Entity selected, PanelRequests& requests, engine::ItemRects* items);

struct HapticsPanelState {
    double strength = 1;  ///< of the mouse's hand
};

/// Pause, reset, presets made from `scene` (the settings it asks for), and the settings one tunes. Returns true when
/// `settings` changed; they then pass checkSettings().
bool drawHapticsPanel(const Settings& scene, Settings& settings, HapticsPanelState& state, PanelRequests& requests,
                      engine::ItemRects* items);

struct DevicePanelView {
    const std::string& device;
    const DeviceFacts& facts;
    const Settings& settings;
    const DeviceControl* control = nullptr;  ///< null: nothing but `trouble` to tell
    const std::string& trouble;              ///< why the device chosen last did not start
};
struct DevicePanelState {
    std::optional<Workspace> edited;  ///< while a value is dragged or typed
};

/// How a device with hardware behind it stands, what the hand feels, and how it lies in the scene.
void drawDevicePanel(const DevicePanelView& view, DevicePanelState& state, PanelRequests& requests,
                     engine::ItemRects* items);

/// What was told since the window opened, newest last, with a button that copies it.
void drawLogPanel(const std::vector<Message>& messages, engine::ItemRects* items);

struct MenuView {
    const std::vector<std::filesystem::path>& scenes;  ///< those found
    const std::vector<std::filesystem::path>& recent;  ///< newest first
    const std::filesystem::path& file;                 ///< of the scene that is shown
    const std::string& device;
    bool running = false, hasScene = false, hasDemonstration = false, hasSelection = false;
    bool canUndo = false, canRedo = false, recording = false;
};
struct MenuState {
    bool panels = true;  ///< all panels are shown
    /// To be opened in this frame.
    bool openDialog = false, replayDialog = false, helpDialog = false, saveDialog = false, addDialog = false,
         leaveDialog = false;
    PanelRequests leaving;  ///< what the dialog asks about
    PathInput openPath{}, replayPath{}, savePath{}, addPath{};
    bool saveSettings = true;
    Role addRole = Role::Obstacle;
};

/// The bar at the top.
void drawMenuBar(const MenuView& view, MenuState& state, DisplayOptions& display, PanelRequests& requests,
                 engine::ItemRects* items);
/// The dialogs that `state` asks for, in windows of their own. After the panels: a window that appears later would
/// close them.
void drawDialogs(const MenuView& view, MenuState& state, PanelRequests& requests, engine::ItemRects* items);

/// Tells how far the scene that is being opened has come, with a button to cancel. A window of its own.
void drawOpening(const OpeningProgress& progress, PanelRequests& requests, engine::ItemRects* items);

}  // namespace touchstone::sandbox
