#pragma once
// The window of the program: scene, panels and mouse around a live session.
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "engine/view/window.hpp"
#include "haptics/sandbox/app/selection.hpp"
#include "haptics/sandbox/panels/live_measure.hpp"
#include "haptics/sandbox/panels/panels.hpp"
#include "haptics/sandbox/panels/status_bar.hpp"
#include "haptics/sandbox/session/session.hpp"

namespace touchstone::sandbox {

/// What a frame of the running window gives to tests and tools.
struct WindowFrame {
    engine::Window& window;
    LiveSession& session;
    DisplayOptions& display;
    LiveMeasure& measure;
    const engine::ItemRects& items;         ///< controls as drawn in the frame before
    std::optional<glm::vec2> toolOnScreen;  ///< C in screen units, where it was drawn
    const engine::OrbitCamera& camera;
    glm::vec4 picture;           ///< of the scene in the window: x, y, x + width, y + height
    const Selection& selection;  ///< of the frame before
    long number = 0;             ///< frames since the window opened
    FrameCost cost;              ///< of the frame before
};

struct WindowRunOptions {
    std::filesystem::path scene;  ///< may be empty: the window then offers the scenes of `folders`
    SessionOptions session;
    std::vector<std::filesystem::path> sceneFolders;  ///< whose .glb and .gltf files the menu lists
    std::filesystem::path
        configFolder;          ///< for the layout and the scenes opened last; empty: nothing is remembered
    std::filesystem::path recordings;  ///< folder for those begun in the window
    std::optional<double> seconds;     ///< closes after this time with a running scene
    std::filesystem::path screenshot;  ///< picture of the last frame with its panels; empty: none
    engine::WindowOptions window;
    DisplayOptions display;
    std::string view;                           ///< as SceneView::look(), of the first scene
    std::optional<std::size_t> select;          ///< index of the node in it that is selected at first
    std::function<void(WindowFrame&)> onFrame;  ///< before each frame's events are handled
    /// Draws a panel of its own; `picture` as in WindowFrame.
    std::function<void(LiveSession&, const glm::vec4& picture, engine::ItemRects&)> panel;
    std::function<void(LiveSession&)> onEnd;  ///< after the last frame, while the loop still runs
};

/// Opens the window and runs until it is closed or `seconds` have passed. Returns 0, or 1 when `scene` could not be
/// opened within `seconds`. Throws std::runtime_error with one sentence when there is no display, or the picture cannot
/// be written; what goes wrong with scenes and devices is told in the window.
int runWindow(const WindowRunOptions& options);

}  // namespace touchstone::sandbox
