#pragma once
// Options of the window, and what its frames give to tests and tools.
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "engine/view/window.hpp"
#include "haptics/sandbox/app/live_measure.hpp"
#include "haptics/sandbox/app/selection.hpp"
#include "haptics/sandbox/panels/panels.hpp"
#include "haptics/sandbox/panels/status_bar.hpp"
#include "haptics/sandbox/session/session.hpp"

namespace touchstone::sandbox {

/// What tests and tools can access in a frame of the running window.
struct WindowFrame {
    engine::Window& window;
    LiveSession& session;
    DisplayOptions& display;
    LiveMeasure& measure;
    const engine::ItemRects& items;         ///< rectangles of the controls in the previous frame
    std::optional<glm::vec2> toolOnScreen;  ///< the tool's center C as drawn, screen units
    const engine::OrbitCamera& camera;
    glm::vec4 picture;                 ///< rectangle of the 3D view in the window: x, y, x + width, y + height
    const Selection& selection;        ///< in the previous frame
    long number = 0;                   ///< frames since the window opened
    FrameCost cost;                    ///< of the previous frame
    std::filesystem::path screenshot;  ///< set it to write a picture of the frame that begins; empty: none
};

struct WindowRunOptions {
    std::filesystem::path scene;  ///< empty: the window offers the scenes in `sceneFolders`
    SessionOptions session;
    std::vector<std::filesystem::path> sceneFolders;  ///< the menu lists their .glb and .gltf files
    std::filesystem::path configFolder;               ///< stores layout and recent scenes; empty: nothing is stored
    std::filesystem::path recordings;                 ///< folder for recordings started in the window
    std::optional<double> seconds;                    ///< close after this time with a running scene
    std::filesystem::path screenshot;                 ///< picture of the last frame with its panels; empty: none
    engine::WindowOptions window;
    DisplayOptions display;
    std::string view;                           ///< initial view of the first scene, a name for SceneView::look()
    std::optional<std::size_t> select;          ///< index of its initially selected node
    std::function<void(WindowFrame&)> onFrame;  ///< called before the events of each frame are handled
    bool study = false;  ///< the panel has the settings, the goal and the device: their controls are hidden
    /// Draws an additional panel; `picture` as in WindowFrame.
    std::function<void(LiveSession&, const glm::vec4& picture, engine::ItemRects&)> panel;
    std::function<void(LiveSession&)> onEnd;  ///< called after the last frame, while the loop still runs
};

}  // namespace touchstone::sandbox
