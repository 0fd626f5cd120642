#pragma once
// Replays a recording by calling step() with the recorded inputs, unchanged.
#include <functional>

#include "haptics/loop/tick_driver.hpp"
#include "haptics/sandbox/record/recording.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// How a replay compares with its recording.
struct ReplayCheck {
    std::uint64_t ticks = 0;
    std::uint64_t same = 0;                  ///< ticks in which all fields that repeat have the recorded bits
    std::optional<std::uint64_t> different;  ///< row of the first tick that has other bits
    std::vector<std::string>
        differences;                ///< sentences: what differs from the time of the recording and may be the cause
    std::uint64_t notCompared = 0;  ///< ticks after lost ticks, whose initial state is unknown
    std::string
        otherPart;  ///< one sentence if a part is not the recorded one, and that not by another build; else empty
};

class ReplayPass {
  public:
    /// `adjust`: changes the recorded settings; null: as recorded. Pre: the scene has a world. Throws
    /// std::runtime_error with one sentence if the recording cannot be read.
    ReplayPass(const HapticScene& scene, const std::filesystem::path& folder,
               std::function<Settings(const Settings&)> adjust);

    /// False after the last tick. Throws as the constructor, and engine::SceneError if another scene of the recording
    /// cannot be opened.
    bool next(TickRecord& record, const TickClocks& clocks, bool audit);

    /// Input and record of the newest tick; its session is the number of the scene.
    const RecordedTick& tick() const { return replayed_; }
    /// The newest tick as the recording has it.
    const RecordedTick& recorded() const { return recorded_; }
    /// World of the newest tick; before next() was called, of the first one.
    const std::shared_ptr<const World>& world() const { return world_; }
    /// As it was recorded, but for the file: where it is now.
    const RecordedScene& scene() const { return scene_; }
    const Settings& settings() const { return settings_; }
    TickState& state() { return *state_; }
    const TickState& state() const { return *state_; }
    const ReplayCheck& check() const { return check_; }
    std::uint64_t rows() const { return recording_.rows(); }

  private:
    void enterScene(const std::filesystem::path& openedFile, const std::shared_ptr<const World>& opened);
    Settings adjusted(const Settings& settings) const { return adjust_ ? adjust_(settings) : settings; }

    const std::filesystem::path folder_;
    Recording recording_;
    RecordedScene scene_;
    std::function<Settings(const Settings&)> adjust_;
    std::shared_ptr<const World> world_;
    std::unique_ptr<TickState> state_;
    std::uint64_t session_ = 0;
    Settings settings_;
    RecordedTick recorded_, replayed_;
    ReplayCheck check_;
    bool settingsNoted_ = false, lost_ = false;
};

}  // namespace touchstone::sandbox
