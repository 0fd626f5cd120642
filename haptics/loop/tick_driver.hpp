#pragma once
// The sequence of a tick without thread or clock: read the device, step, safety stage, write the device. It makes every
// change without a jump of the force.
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "haptics/device/device.hpp"
#include "haptics/device/emergency_stop.hpp"
#include "haptics/device/safety.hpp"
#include "haptics/loop/neighbor_list_worker.hpp"
#include "haptics/loop/settings.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/threads/ramp.hpp"

namespace touchstone {

/// Everything of a scene that the loop needs. It is constructed off the loop, where the tick's memory is allocated and
/// touched, handed to the loop as a whole, and freed off the loop.
struct Session {
    Session(std::shared_ptr<const World> world_, const Settings& settings_, std::unique_ptr<Device> device_,
            std::uint64_t number_ = 0);

    std::shared_ptr<const World> world;
    Settings settings;
    std::unique_ptr<Device> device;
    TickState state;
    SafetyStage safety;
    std::vector<Pose> X_WO;                          ///< target poses of the obstacles
    std::unique_ptr<NeighborListWorker> listWorker;  ///< finds lists ahead of the ticks; null: ticks find their own
    std::uint64_t number;                            ///< chosen by the owner to tell sessions apart
};

/// Optional clocks; none of them changes the result of step().
struct TickClocks {
    StageClock stage;
    double (*cpuMicroseconds)() = nullptr;  ///< of the calling thread; for TickRecord::totalUs, the time of step() only
    double periodMs = 0;  ///< measured since the previous tick began; if it is far too long, the force drops to zero
    std::atomic<bool>* hung = nullptr;  ///< set by the watchdog that released the device's forces; the tick clears it
};

/// What the safety stage takes from a tick: its wrench, and the flags that must stop the force. Real time.
SafetyInput safetyInput(const TickRecord& record) noexcept;

/// The sequence of each tick, shared by the loop's thread, headless runs and tests. Ramps and fades count ticks, so
/// runs are bit-reproducible.
/// - A change of stiffness or torsion ramps over 200 ms.
/// - A change of mode, solver, rate, pause or scene, and a restart, fade the force out over 50 ms, take effect at zero
///   force, and fade it in over 100 ms; if there is no force, they take effect at once. The force also fades in at the
///   start of a session, after engaging, and after a trip of the safety stage that set it to zero.
/// - All other changes take effect at the next tick.
/// A session with a device that has motors begins stopped (SafetyStage), also after a restart. The tool is held until
/// engage(), which sets the device to the tool's pose and never moves the tool to the device. While the setting
/// dead_man names a button, releasing it stops and pressing it engages. Only one thread may call it at a time. Real
/// time: tick() and the requests do not allocate, free, lock, log or throw.
class TickDriver {
  public:
    static constexpr double kFadeOutMs = 50, kFadeInMs = 100, kStiffnessRampMs = 200;

    explicit TickDriver(std::unique_ptr<Session> session);
    ~TickDriver();  ///< leaves the device with zero force
    TickDriver(const TickDriver&) = delete;
    TickDriver& operator=(const TickDriver&) = delete;

    /// Settings for the newest session, which may still be opening. Pre: checkSettings() finds no error.
    void request(const Settings& settings) noexcept;
    /// Target poses for the newest session's obstacles, X_WO by obstacle. They move a little in every tick, see step().
    void moveObstacles(std::span<const Pose> X_WO) noexcept;
    /// Switches to another session. Pre: !opening(), and the last retired session was taken.
    void open(std::unique_ptr<Session> session) noexcept;
    bool opening() const { return next_ != nullptr; }
    /// The session that was replaced, once; null otherwise. The caller frees it.
    std::unique_ptr<Session> takeRetired() noexcept { return std::move(retired_); }
    /// Resets device time to zero and moves the tool to the device's first pose.
    void restart() noexcept;

    /// Zero force and a held tool from this tick on, until engage().
    void stop() noexcept { session_->safety.stop(); }
    /// After a stop or a fault: the device continues from the tool's pose. Does nothing if the device is engaged.
    void engage() noexcept;
    /// The tool continues from where `last`, the newest tick, left it, and everything else is forgotten, so that the
    /// ticks from here on can be reproduced from a recording.
    void resume(const TickRecord& last) noexcept { session_->state.resume(last); }

    /// With `audit` as in step().
    TickRecord tick(const TickClocks& clocks = {}, bool audit = false) noexcept;

    const Session& session() const { return *session_; }
    /// Number of the newest session, which may still be opening.
    std::uint64_t newestSession() const { return next_ ? next_->number : session_->number; }
    /// The settings in effect; stiffness and torsion are the targets of their ramps.
    const Settings& settings() const { return session_->settings; }
    double fade() const { return fade_.value(); }
    /// The device's motion has ended.
    bool finished() const { return finished_; }
    /// Device time of the next tick, ms: tick n of a session reads the device at n / rate.
    double time() const { return timeBase_ + static_cast<double>(ticks_) * 1000.0 / settings().rate; }

  private:
    int ticksIn(double ms) const;
    void beginSwitch();
    void finishSwitch();
    void startOver();
    void fadeIn();
    bool holds(const DeviceReading& reading) const;
    bool stopped() const { return session_->safety.engagement() == Engagement::Stopped; }

    std::unique_ptr<Session> session_, next_, retired_;
    Settings settingsAfterSwitch_;  // of session_
    bool switching_ = false;
    bool restarting_ = false;
    Ramp fade_, stiffness_, torsion_;

    double timeBase_ = 0;      // device time at the last change of rate, ms
    std::uint64_t ticks_ = 0;  // since then
    bool first_ = true;        // the tool begins at the next valid pose while not stopped
    bool held_ = true;         // the dead-man button was held in the last tick; pressing it again engages
    bool forceOut_ = false;    // the last wrench sent to the device was not zero, so a switch has to fade it out
    bool finished_ = false;
    Pose X_WT_device_;             // the last valid reading
    Pose X_WT_tool_;               // the graphic tool after the last tick
    EmergencyStop emergencyStop_;  // of the session's device
};

}  // namespace touchstone
