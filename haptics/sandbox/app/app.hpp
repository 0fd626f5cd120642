#pragma once
// The running window: what it remembers from frame to frame. One file for what a frame draws, one for mouse and keys,
// one for what is then done; none of it is needed outside.
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/edit/undo.hpp"
#include "engine/ui/panel_layout.hpp"
#include "engine/ui/user_files.hpp"
#include "engine/view/renderer.hpp"
#include "haptics/sandbox/app/app_window.hpp"
#include "haptics/sandbox/app/mouse_grab.hpp"

namespace touchstone::sandbox {

/// All that undo goes back to.
struct UserState {
    std::vector<engine::SceneEdit> edits;
    Settings settings;  ///< never paused: pausing is no change
    friend bool operator==(const UserState&, const UserState&) = default;
};

class App {
  public:
    explicit App(const WindowRunOptions& options);
    int run();

  private:
    bool beginFrame(bool& last);
    void rememberSize(bool first);
    void refreshScene();
    void drawPicture(const engine::Area& area);
    void drawPanels(const engine::Layout& layout);
    void drawBar();
    void drawHints(const engine::Area& picture) const;
    void drawLeftPanel();
    void drawGuideWindow(const engine::Area& picture);
    void drawPull(const engine::Area& picture) const;
    void handleMouse(const engine::Area& picture);
    void handleKeys();
    void carryOut();
    void noteState();
    void goTo(const std::optional<UserState>& state);
    void copyCommand();
    void toggleRecording();
    bool timeIsUp();
    void lookAtAll(const engine::Area& picture);
    /// Work for the graphics driver, whose processor time is told apart.
    template <class Work>
    void draw(Work&& work) {
        const double began = threadCpuMicroseconds();
        work();
        drawingMs_ += 1e-3 * (threadCpuMicroseconds() - began);
    }
    void noteCost(double cpuMs);
    ToolPoses toolPoses() const;

    using Clock = std::chrono::steady_clock;

    const WindowRunOptions& options_;
    engine::PanelSizes sizes_;  // these two outlive the window, which writes them when it closes
    std::string iniFile_;
    engine::Window window_;
    engine::Renderer renderer_;
    LiveSession session_;
    std::vector<std::filesystem::path> scenes_;
    engine::RecentScenes recent_;

    std::shared_ptr<HapticScene> viewed_;  // outlives the view of it
    std::unique_ptr<SceneView> view_;
    std::uint64_t viewedNumber_ = 0;
    std::filesystem::path viewedFile_;
    std::string title_;
    engine::OrbitCamera camera_;
    engine::Area picture_;
    MouseGrab grab_;
    std::uint64_t grabSession_ = 0;
    Selection selection_;
    double strength_ = 1;  // of the hand that the mouse device was told of last
    bool holding_ = false, everHeld_ = false, focused_ = false;

    DisplayOptions display_;
    ScenePanelState scenePanel_;
    LiveMeasure measure_;
    InspectorState inspector_;
    engine::Entity pageNode_;  // that the left panel's pages were of
    std::string pageDevice_;
    HapticsPanelState hapticsPanel_;
    DevicePanelState devicePanel_;
    MenuState menu_;
    PanelRequests requests_;
    engine::UndoStack<UserState> undo_;
    std::filesystem::path undoFile_;  // that the states are of
    engine::ItemRects items_, drawnItems_;
    FrameCost cost_, shownCost_;
    double drawingMs_ = 0;  // of this frame
    std::optional<glm::vec2> toolOnScreen_;
    std::optional<Clock::time_point> runningSince_;
};

}  // namespace touchstone::sandbox
