#pragma once
// A live session: opens scenes in the background, runs the haptic loop, and gives the window its current state.
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "haptics/loop/haptic_loop.hpp"
#include "haptics/sandbox/record/motion_recorder.hpp"
#include "haptics/sandbox/scene/marking.hpp"
#include "haptics/sandbox/session/device_facts.hpp"
#include "haptics/sandbox/session/live_recording.hpp"
#include "haptics/sandbox/session/message_log.hpp"
#include "haptics/sandbox/session/obstacle_moves.hpp"
#include "haptics/sandbox/session/scene_opening.hpp"
#include "haptics/sandbox/session/tick_history.hpp"
#include "haptics/sandbox/session/workspace_file.hpp"

namespace touchstone::sandbox {

struct SessionOptions {
    std::string device;  ///< NAME or NAME:FILE for every scene; empty: its demonstration, else the mouse
    /// Applies the command line to the settings of a scene that is opened. May throw std::exception.
    std::function<Settings(const Settings&)> adjust;
    /// Called by update() with every tick that was not dropped, in order, after it was recorded; may stop the
    /// recording.
    std::function<void(const TickRecord&)> onTick;
    std::filesystem::path record;  ///< folder for a recording from the first scene on; empty: none
    std::filesystem::path treeCache = treeCacheFolder();
    std::filesystem::path configFolder;  ///< where workspaces of devices are saved; empty: kept until the program ends
    LoopOptions loop;
};

/// Owned and called by the window's thread. Errors become messages and are never thrown; the previous scene stays.
class LiveSession {
  public:
    explicit LiveSession(SessionOptions options = {});
    ~LiveSession();  ///< stops the loop; the device is left with zero force
    LiveSession(const LiveSession&) = delete;
    LiveSession& operator=(const LiveSession&) = delete;

    /// Starts reading a scene and building its trees on its own thread. Replaces an opening in progress.
    void open(SceneRequest request);
    void cancelOpening();
    std::optional<OpeningProgress> opening() const;
    /// Reads the file of the current scene again and drops unsaved changes.
    void reload();
    /// Adds changes to those of the current scene.
    void edit(std::vector<engine::SceneEdit> more);
    /// Gives roles and trees that the user chose. If one cannot be given, reports it and applies none.
    void mark(const std::vector<Marking>& markings);
    /// Makes the present tool pose the goal of the scene, see goalHere(). The loop runs on.
    void setGoalHere();
    /// Replaces the changes of the current scene and keeps its settings. If only obstacles moved, they move while the
    /// loop runs. If the start of the tool moved, the tool restarts there, but with another demonstration it stays
    /// where it is. Looks, names and the goal change at once. Any other difference reopens the scene.
    void setEdits(std::vector<engine::SceneEdit> edits);
    /// Writes the current scene, and its settings if requested, into a copy of its file or the file itself. The written
    /// file becomes the scene's file. Returns false on failure, which is reported as a message.
    bool save(const std::filesystem::path& file, bool withSettings);

    /// Call once a frame. Takes over a scene that is ready, the newest snapshot, and all ticks since the last call.
    void update();

    /// The scene to draw; null before the first one. It has no world while roles are missing. Its X_WO are where the
    /// newest tick left the obstacles, possibly still moving to their poses in the scene.
    const std::shared_ptr<HapticScene>& scene() const { return shown_.scene; }
    /// Increases by one whenever another scene replaces the one in scene().
    std::uint64_t sceneNumber() const { return sceneNumber_; }
    const SceneRequest& request() const { return shown_.request; }
    /// The newest request, whether it is shown yet or not.
    const SceneRequest& newest() const;
    /// Whether the loop runs the scene that is shown.
    bool running() const { return loop_ && shown_.scene && shown_.scene->world && ticked_; }

    /// The newest tick of the scene that is shown; null while there is none.
    const TickRecord* record() const { return running() ? &loop_->snapshot().record : nullptr; }
    /// Health of the loop; null before the first scene runs.
    const LoopSnapshot* snapshot() const { return loop_ ? &loop_->snapshot() : nullptr; }
    const RealTimeStatus* realTime() const { return loop_ ? &loop_->realTime() : nullptr; }
    const TickHistory& history() const { return history_; }

    /// The settings requested last; those in effect are snapshot()->settings.
    const Settings& settings() const { return settings_; }
    /// If they touch spheres that the scene was opened without, opens it again, with trees and these settings.
    void setSettings(const Settings& settings);
    /// Builds the sphere trees that the world lacks, to be shown; then the scene starts again.
    void buildTrees();
    /// Resets device and tool to the start of the scene.
    void restart();
    void stop();    ///< holds the tool with zero force
    void engage();  ///< engages the device at the current tool pose
    /// Whether the device is neither stopped nor faulted.
    bool engaged() const;
    /// Whether a new scene or device is about to replace the running one.
    bool switching() const { return next_.has_value(); }

    const SessionDevice& device() const { return device_; }
    /// Replaces the device. The new one takes over the tool where it is; with fromStart, or if the device is the same,
    /// both return to the start of the scene.
    void chooseDevice(const std::string& choice, bool fromStart = false);
    /// Places the device in the scene, now and in later runs. If the scale changes, the device fades out and takes over
    /// the tool where it is.
    void setWorkspace(const Workspace& workspace);
    void reconnectDevice();
    void initializeDevice();  ///< moves the device; the user has agreed
    /// Records what the device does, from now on, for finishDemonstration(). A reset of the tool begins it again, and
    /// another scene ends it. After kLongestDemonstrationMs it finishes by itself.
    void recordDemonstration();
    /// Makes what was recorded the demonstration of the scene, as an edit, unless nothing moved.
    void finishDemonstration();
    static constexpr double kLongestDemonstrationMs = 600'000;
    /// Null while no demonstration is recorded.
    const MotionRecorder* demonstration() const { return demonstration_ ? &*demonstration_ : nullptr; }
    /// Records into its own folder from now on, or, while switching(), from the first tick of the new scene or device.
    /// The tool continues unchanged. Scenes, devices and settings may change during a recording.
    void record(const std::filesystem::path& folder);
    LiveRecording& recording() { return recording_; }
    const LiveRecording& recording() const { return recording_; }
    MessageLog& log() { return log_; }
    const MessageLog& log() const { return log_; }

  private:
    struct Shown {
        SceneRequest request;
        std::shared_ptr<HapticScene> scene;
        std::shared_ptr<const World> world;  ///< becomes scene->world when it is shown
    };

    void takeOpened();
    void change(SceneRequest request, const std::vector<engine::SceneEdit>& changes);
    void show(Shown next);
    /// The shown scene, with a world that starts the obstacles where they are now.
    Shown shownNow() const;
    void start(const Shown& next, const Settings& settings, const std::string& choice, const Pose& X_WT_start);
    /// Like start(), but falls back to the mouse if the chosen device cannot start.
    void startOrMouse(const Shown& next, const Settings& settings, const std::string& choice, const Pose& X_WT_start);
    void sayTrips(const LoopSnapshot& snapshot);
    void take(const RecordedTick& tick);
    void followRecordedSettings();
    void sayDevice();
    bool lacksSpheres(const Settings& settings) const;
    /// Reports the parts that are touched by their spheres although the settings ask for meshes.
    void saySpheres(const HapticScene* scene);
    /// Lowers settings to the limits of the device and of a solver's round trip, and reports each as a message.
    Settings capped(Settings settings);

    SessionOptions options_;
    MessageLog log_;
    std::vector<std::unique_ptr<SceneOpening>> openings_;  ///< the last one counts; the others are being cancelled
    Shown shown_;
    std::uint64_t sceneNumber_ = 0;

    Settings settings_;
    SessionDevice device_;
    WorkspaceFile workspaces_;
    TickHistory history_;
    std::array<std::uint64_t, kTripCount> saidTrips_{};
    ObstacleMoves obstacleMoves_;
    bool saidHang_ = false, saidByProcessor_ = false;
    std::optional<MotionRecorder> demonstration_;
    std::uint64_t loopSession_ = 0;               ///< number of the newest session given to the loop
    std::optional<Shown> next_;                   ///< given to the loop, shown when it ticks
    std::vector<RecordedHand::Change> replayed_;  ///< settings of the recording that is played
    std::size_t nextReplayed_ = 0;
    double replayMs_ = 0;
    bool ticked_ = false;  ///< the snapshot is of the scene shown
    std::unique_ptr<HapticLoop> loop_;
    LiveRecording recording_{log_};  // after the loop: it goes first
};

}  // namespace touchstone::sandbox
