#pragma once
// A live session: scenes come and go off the loop's thread, the loop ticks, and the window asks how things stand.
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "haptics/loop/haptic_loop.hpp"
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
    /// From the settings of a scene to those it starts with: what the command line sets. May throw std::exception.
    std::function<Settings(const Settings&)> adjust;
    /// Sees every tick that was not dropped, in order, from update(), when it is recorded; it may stop the recording.
    std::function<void(const TickRecord&)> onTick;
    std::filesystem::path record;  ///< folder for a recording from the first scene on; empty: none
    std::filesystem::path treeCache = treeCacheFolder();
    std::filesystem::path configFolder;  ///< for how devices lie in scenes; empty: remembered for this run alone
    LoopOptions loop;
};

/// Owned and called by the window's thread. What goes wrong is told as a message, never thrown; the scene before then
/// stays.
class LiveSession {
  public:
    explicit LiveSession(SessionOptions options = {});
    ~LiveSession();  ///< stops the loop; the device is left with zero force
    LiveSession(const LiveSession&) = delete;
    LiveSession& operator=(const LiveSession&) = delete;

    /// Starts reading a scene and building its trees on a thread of its own, in place of one that is still being
    /// opened.
    void open(SceneRequest request);
    void cancelOpening();
    std::optional<OpeningProgress> opening() const;
    /// Opens the present scene's file again, as it stands there.
    void reload();
    /// Further changes of the present scene.
    void edit(std::vector<engine::SceneEdit> more);
    /// Roles and trees chosen by hand; one that cannot be given is a message, and none of them is then.
    void mark(const std::vector<Marking>& markings);
    /// The present scene with these changes in place of those it has, and with the settings it runs with. Obstacles
    /// that only stand elsewhere are moved while the loop runs, as those that are dragged in scene() are; a tool that
    /// starts elsewhere starts anew; looks and names change at once; all else is opened anew.
    void setEdits(std::vector<engine::SceneEdit> edits);
    /// Writes the scene as it stands, on wish with the settings, into a copy of its file, or into it; the written file
    /// is the scene's from then on. False when that failed, which is told.
    bool save(const std::filesystem::path& file, bool withSettings);

    /// To be called once a frame: takes over a scene that is ready, the newest snapshot and all ticks since the last
    /// call.
    void update();

    /// The scene to draw; null before the first. It has no world while roles are missing; else its world has obstacles
    /// where the newest tick left them, which is on their way to where the scene has them.
    const std::shared_ptr<HapticScene>& scene() const { return shown_.scene; }
    /// One more with each scene that takes the place of another in scene().
    std::uint64_t sceneNumber() const { return sceneNumber_; }
    const SceneRequest& request() const { return shown_.request; }
    /// What the scene is becoming: that of the newest change, shown or on its way.
    const SceneRequest& newest() const;
    /// The loop ticks the scene that is shown.
    bool running() const { return loop_ && shown_.scene && shown_.scene->world && ticked_; }

    /// The newest tick of the scene that is shown; null while there is none.
    const TickRecord* record() const { return running() ? &loop_->snapshot().record : nullptr; }
    /// Health of the loop; null before the first scene runs.
    const LoopSnapshot* snapshot() const { return loop_ ? &loop_->snapshot() : nullptr; }
    const RealTimeStatus* realTime() const { return loop_ ? &loop_->realTime() : nullptr; }
    const TickHistory& history() const { return history_; }

    /// The newest settings asked for; snapshot()->settings are in force.
    const Settings& settings() const { return settings_; }
    void setSettings(const Settings& settings);
    /// Device and tool back to the start of the scene.
    void restart();
    /// Zero force and the tool held, or from there on with the device where the tool is.
    void stop();
    void engage();
    /// Not stopped, and no fault.
    bool engaged() const;
    /// A scene or a device is about to take the place of what runs.
    bool switching() const { return next_.has_value(); }

    const SessionDevice& device() const { return device_; }
    /// Another device in place of the present one. It takes the tool over where it is, or all begins at the scene's
    /// start, as it always does where the device is the same.
    void chooseDevice(const std::string& choice, bool fromStart = false);
    /// How the device lies in the scene, from now on and in later runs. Another scale takes the tool up anew where it
    /// is, after a fade.
    void setWorkspace(const Workspace& workspace);
    void reconnectDevice();
    /// Records from now on into a folder of its own, while switching() from the first tick of what comes; the tool goes
    /// on as it is. Scenes, devices and settings may change.
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
    /// What is shown, as a start from where the obstacles are now.
    Shown shownNow() const;
    void start(const Shown& next, const Settings& settings, const std::string& choice, const Pose& X_WT_start);
    /// Starts, with the mouse where the device of that choice cannot.
    void startOrMouse(const Shown& next, const Settings& settings, const std::string& choice);
    void sayTrips(const LoopSnapshot& snapshot);
    void take(const RecordedTick& tick);
    void followRecordedSettings();
    void sayDevice();
    /// No more than the device is made for; what is lowered is a message.
    Settings capped(Settings settings);

    SessionOptions options_;
    MessageLog log_;
    std::vector<std::unique_ptr<SceneOpening>> openings_;  ///< the last is wanted, the others are being cancelled
    Shown shown_;
    std::uint64_t sceneNumber_ = 0;

    Settings settings_;
    SessionDevice device_;
    WorkspaceFile workspaces_;
    TickHistory history_;
    std::array<std::uint64_t, kTripCount> saidTrips_{};
    ObstacleMoves obstacleMoves_;
    bool saidHang_ = false;
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
