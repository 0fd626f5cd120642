#pragma once
// The running window and its state between frames. app_panels.cpp draws, app_input.cpp handles mouse and keyboard,
// app_requests.cpp carries out requests. Private to this folder.
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
#include "haptics/sandbox/app/app_options.hpp"
#include "haptics/sandbox/app/mouse_grab.hpp"
#include "haptics/sandbox/app/open_dialog.hpp"
#include "haptics/threads/rt_thread.hpp"

namespace touchstone::sandbox {

/// The state that undo restores.
struct UserState {
    std::vector<engine::SceneEdit> edits;
    Settings settings;  ///< `pause` is always off, since pausing cannot be undone
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
    void drawPicture(const engine::Area& area, bool fully);
    void drawPanels(const engine::Layout& layout);
    void drawBar();
    void drawHints(const engine::Area& picture) const;
    void drawLeftPanel();
    bool asksUnit() const;
    float guideWidth() const;
    void drawGuideWindow(const engine::Area& picture);
    void drawMousePull(const engine::Area& picture) const;
    void handleMouse(const engine::Area& picture);
    void handleKeys();
    void carryOut();
    void noteState();
    void noteStuck();
    void restoreState(const std::optional<UserState>& state);
    void copyCommand();
    void toggleRecording();
    void makeStudy(const std::filesystem::path& folder);
    bool timeIsUp();
    void frameAll(const engine::Area& picture);
    /// Runs work for the graphics driver and adds its CPU time to `drawingMs_`.
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
    engine::PanelSizes sizes_;  // sizes_ and iniFile_ must outlive the window, which writes them when it closes
    std::string iniFile_;
    engine::Window window_;
    engine::Renderer renderer_;
    LiveSession session_;
    std::vector<std::filesystem::path> scenes_;
    engine::RecentScenes recent_;

    std::shared_ptr<HapticScene> viewed_;  // must outlive view_
    std::unique_ptr<SceneView> view_;
    std::uint64_t viewedNumber_ = 0;
    std::filesystem::path viewedFile_;
    std::string title_;
    engine::OrbitCamera camera_;
    engine::Area picture_;
    MouseGrab grab_;
    std::uint64_t grabSession_ = 0;
    Selection selection_;
    double strength_ = 1;  // stiffness of the hand last sent to the mouse device
    bool holding_ = false, everHeld_ = false, focused_ = false;

    DisplayOptions display_;
    std::uint64_t treesFor_ = 0;  ///< number of the scene for which trees were last requested
    ScenePanelState scenePanel_;
    LiveMeasure measure_;
    StuckWatch stuck_;
    InspectorState inspector_;
    engine::Entity pageNode_;  // node and device of the left panel's pages in the previous frame
    std::string pageDevice_;
    std::uint64_t sizeKept_ = 0;  // the scene whose unit was asked about
    HapticsPanelState hapticsPanel_;
    DevicePanelState devicePanel_;
    MenuState menu_;
    OpenDialog openDialog_;
    PanelRequests requests_;
    engine::UndoStack<UserState> undo_;
    std::filesystem::path undoFile_;  // scene that the undo states belong to
    engine::ItemRects items_, drawnItems_;
    FrameCost cost_, shownCost_;
    double drawingMs_ = 0;  // CPU time of drawing in this frame, ms
    /// The picture of the scene in the last frame.
    struct Drawn {
        engine::Frame frame;
        engine::Viewport viewport;
    };
    std::optional<Drawn> drawn_;
    Clock::time_point changed_, frameEnded_;  // when the picture last changed, and the last frame ended
    std::optional<glm::vec2> toolOnScreen_;
    std::optional<Clock::time_point> runningSince_;
};

}  // namespace touchstone::sandbox
