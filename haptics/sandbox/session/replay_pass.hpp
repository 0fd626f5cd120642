#pragma once
// A recording's ticks again, by step() alone: what it was given is handed over unchanged.
#include <functional>

#include "haptics/loop/tick_driver.hpp"
#include "haptics/sandbox/record/recording.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// How a replay compares with the recording.
struct ReplayCheck {
    std::uint64_t ticks = 0;
    std::uint64_t same = 0;                ///< all fields that repeat have the recorded bits
    std::optional<std::uint64_t> other;    ///< row of the first tick that has not
    std::vector<std::string> differences;  ///< sentences: what is not as it was recorded, and may be why
    std::uint64_t notCompared = 0;         ///< ticks after ticks that were lost: nothing tells where they began
};

class ReplayPass {
  public:
    /// `adjust`: from recorded settings to those to use; null: as recorded. Pre: the scene has a world. Throws
    /// std::runtime_error with one sentence when the recording cannot be read.
    ReplayPass(const HapticScene& scene, const std::filesystem::path& folder,
               std::function<Settings(const Settings&)> adjust);

    /// False after the last tick. Throws as the constructor, and engine::SceneError when a scene that comes up in the
    /// recording cannot be opened.
    bool next(TickRecord& record, const TickClocks& clocks, bool audit);

    /// What the newest tick was given and did, numbered by scene.
    const RecordedTick& tick() const { return done_; }
    /// Of the newest tick; before the first, of that.
    const std::shared_ptr<const World>& world() const { return world_; }
    const RecordedScene& scene() const { return recording_.scene(); }
    const Settings& settings() const { return settings_; }
    StepState& state() { return *state_; }
    const StepState& state() const { return *state_; }
    const ReplayCheck& check() const { return check_; }

  private:
    void enterScene(const std::filesystem::path& openedFile, const std::shared_ptr<const World>& opened);
    Settings adjusted(const Settings& settings) const { return adjust_ ? adjust_(settings) : settings; }

    Recording recording_;
    std::function<Settings(const Settings&)> adjust_;
    std::shared_ptr<const World> world_;
    std::unique_ptr<StepState> state_;
    std::vector<Pose> targets_;  // of the obstacles
    std::uint64_t session_ = 0;
    Settings settings_;
    RecordedTick recorded_, done_;
    ReplayCheck check_;
    bool toldSettings_ = false, lost_ = false;
};

}  // namespace touchstone::sandbox
