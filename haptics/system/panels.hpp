#pragma once
// The panels. Each is a function that draws into the current ImGui window what `view` says and changes what it is
// given; what it cannot do itself it asks for in PanelRequests. ItemRects may be null everywhere.
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "haptics/system/scene_view.hpp"
#include "haptics/system/session.hpp"
#include "haptics/system/widgets.hpp"

namespace touchstone::system {

/// What the user asked for in a frame.
struct PanelRequests {
    std::optional<std::filesystem::path> open;
    std::optional<std::string> device;                                   ///< NAME or NAME:FILE
    std::optional<std::pair<engine::Entity, std::optional<Role>>> role;  ///< for a node; nothing takes it away
    std::optional<std::filesystem::path> saveRoles;
    std::string refusal;  ///< a value that was typed and not accepted
    bool reload = false, restart = false, cancelOpening = false, frameCamera = false, quit = false;
};

using PathInput = std::array<char, 1024>;

struct ScenePanelState {
    engine::Entity selected;
    PathInput savePath{};
};

/// Entities with visibility and roles, what is drawn besides, and the levels of the sphere trees. `edited`: roles were
/// given by hand.
void drawScenePanel(HapticScene& scene, bool edited, DisplayOptions& display, ScenePanelState& state,
                    PanelRequests& requests, ItemRects* items);

/// Pause, reset, and the settings one tunes. Returns true when `settings` changed; they then pass checkSettings().
bool drawHapticsPanel(Settings& settings, PanelRequests& requests, ItemRects* items);

/// The messages, newest last.
void drawStatusPanel(const std::vector<Message>& messages);

struct MenuView {
    const std::vector<std::filesystem::path>& scenes;  ///< those found
    const std::string& device;
    bool hasScene = false, hasDemonstration = false;
};
struct MenuState {
    bool panels = true;                                                 ///< all panels are shown
    bool openDialog = false, replayDialog = false, helpDialog = false;  ///< to be opened in this frame
    PathInput openPath{}, replayPath{};
};

/// The bar at the top.
void drawMenuBar(const MenuView& view, MenuState& state, DisplayOptions& display, PanelRequests& requests,
                 ItemRects* items);
/// The dialogs that `state` asks for, in windows of their own. After the panels: a window that appears later would
/// close them.
void drawDialogs(const MenuView& view, MenuState& state, PanelRequests& requests, ItemRects* items);

/// Tells how far the scene that is being opened has come, with a button to cancel. A window of its own.
void drawOpening(const OpeningProgress& progress, PanelRequests& requests, ItemRects* items);

}  // namespace touchstone::system
