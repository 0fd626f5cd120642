#pragma once
// One tick after another, without thread or clock: device, step, safety, device, and every change without a jolt.
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

/// Everything that a scene brings to the loop. Built off the loop (the tick's memory is taken and touched here), handed
/// over whole, and freed off the loop.
struct Session {
    Session(std::shared_ptr<const World> world_, const Settings& settings_, std::unique_ptr<Device> device_,
            std::uint64_t number_ = 0);

    std::shared_ptr<const World> world;
    Settings settings;
    std::unique_ptr<Device> device;
    StepState state;
    SafetyStage safety;
    std::vector<Pose> X_WO;                      ///< where the obstacles are to go
    std::unique_ptr<NeighborListWorker> keeper;  ///< null: ticks find their own lists
    std::uint64_t number;                        ///< the holder's; tells sessions apart
};

/// Optional clocks; none of them changes what step() answers.
struct TickClocks {
    StageClock stage;
    double (*cpuMicroseconds)() =
        nullptr;          ///< of the calling thread; for TickRecord::totalUs, the time of step() alone
    double periodMs = 0;  ///< by the clock, since the tick before began; much too long, and the force falls to zero
    std::atomic<bool>* hung = nullptr;  ///< set by who let go of the device for want of ticks; the tick clears it
};

/// The per-tick sequence that the loop's thread, headless runs and tests share. Ramps and fades count ticks, so runs
/// repeat.
/// - A change of stiffness or torsion ramps over 200 ms.
/// - A change of mode, solver, rate, pause or scene, and a restart, fade the force out over 50 ms, happen at zero
/// force, and
///   fade it in over 100 ms; without force to fade they happen at once. The start of a session, engaging, and the end
///   of a trip of the safety stage that set the force to zero fade in likewise.
/// - All else acts at the next tick.
/// A session with a device that has motors, and a restart of it, begin stopped (SafetyStage): the tool is held until
/// engage(), which sets the device onto the tool, never the tool onto the device. While the setting dead_man names a
/// button, letting go of it stops and pressing it engages.
/// One thread at a time. Real time: tick() and the requests allocate, free, lock, log and throw nothing.
class TickDriver {
  public:
    static constexpr double kFadeOutMs = 50, kFadeInMs = 100, kStiffnessRampMs = 200;

    explicit TickDriver(std::unique_ptr<Session> session);
    ~TickDriver();  ///< leaves the device with zero force
    TickDriver(const TickDriver&) = delete;
    TickDriver& operator=(const TickDriver&) = delete;

    /// Settings for the newest session, opening or open. Pre: checkSettings() is content.
    void request(const Settings& settings) noexcept;
    /// Where the newest session's obstacles are to go, X_WO by obstacle; they get there tick by tick, see step().
    void moveObstacles(std::span<const Pose> X_WO) noexcept;
    /// Switches to another session. Pre: !opening(), and the last retired one was taken.
    void open(std::unique_ptr<Session> session) noexcept;
    bool opening() const { return next_ != nullptr; }
    /// The session that was replaced, once; null otherwise. Freeing it is the caller's.
    std::unique_ptr<Session> takeRetired() noexcept { return std::move(retired_); }
    /// Device time back to zero and the tool to the device's first pose.
    void restart() noexcept;

    /// Zero force from this tick on, and the tool held, until engage().
    void stop() noexcept { session_->safety.stop(); }
    /// After a stop or a fault: the device goes on where the tool is. Does nothing where it is engaged.
    void engage() noexcept;
    /// The tool goes on from where `last`, the newest tick, left it, and nothing else is remembered: from here on what
    /// happens can be repeated.
    void resume(const TickRecord& last) noexcept { session_->state.resume(last); }

    /// With `audit` as in step().
    TickRecord tick(const TickClocks& clocks = {}, bool audit = false) noexcept;

    const Session& session() const { return *session_; }
    /// Number of the newest session, opening or open.
    std::uint64_t newestSession() const { return next_ ? next_->number : session_->number; }
    /// In force now; stiffness and torsion are where their ramps end.
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
    Settings wanted_;  // of session_ after the switch
    bool switching_ = false;
    bool restarting_ = false;
    Ramp fade_, stiffness_, torsion_;

    double timeBase_ = 0;      // device time at the last change of rate, ms
    std::uint64_t ticks_ = 0;  // since then
    bool first_ = true;        // the next valid pose while not stopped is where the tool begins
    bool held_ = true;         // the dead-man button, in the tick before: a new hold engages
    bool forceOut_ = false;    // the last wrench sent to the device was not zero, so a switch has to fade it out
    bool finished_ = false;
    Pose X_WT_last_;               // last valid reading
    Pose X_WT_before_;             // of the graphic tool
    EmergencyStop emergencyStop_;  // on the session's device
};

}  // namespace touchstone
