#pragma once
// The haptic thread: ticks at a constant rate, controlled and observed without a lock.
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "haptics/device/device.hpp"
#include "haptics/device/trips.hpp"
#include "haptics/loop/settings.hpp"
#include "haptics/loop/tick.hpp"
#include "haptics/loop/world.hpp"
#include "haptics/threads/real_time.hpp"

namespace touchstone {

struct RecordedTick;

struct LoopOptions {
    RealTimeOptions realTime;
    std::size_t ringCapacity = 1 << 14;  ///< ticks: 16 s at 1 kHz
    WorkShares shares;
    bool listWorker = std::thread::hardware_concurrency() > 1;  ///< run a NeighborListWorker for each session
    /// Time without a tick after which the forces of a device with engaged motors are released, ms; 0: never. A shorter
    /// time can release them during a pause of the system; with a longer one a hung loop holds its last force longer.
    double watchdogMs = 250;
};

/// The newest tick and the loop's health.
struct LoopSnapshot {
    TickRecord record;
    std::vector<Pose> X_WO;                     ///< poses of the obstacles after the tick
    Settings settings;                          ///< in effect, with the work limits of this machine
    std::uint64_t session = 0;                  ///< 0 for the first session, one more with each open()
    std::uint64_t ticks = 0;                    ///< since the loop began
    std::uint64_t overruns = 0;                 ///< late ticks: those that ended after their deadline
    std::uint64_t dropped = 0;                  ///< records lost because the ring was full
    double rate = 0;                            ///< measured over the last quarter of a second, Hz; 0 before
    double fade = 0;                            ///< factor on the force while it fades in or out, 0 to 1
    bool finished = false;                      ///< the device's motion has ended
    std::array<TripCount, kTripCount> trips{};  ///< of the session's safety stage, by Trip, since it began
    Engagement engagement = Engagement::Stopped;
    Trip cause = Trip::NotFinite;  ///< of the fault, while the engagement is a fault
};

/// Owns the thread, the tick's state and the device. All functions are for one other thread (the view's). None of them
/// blocks, and nothing that is given to the loop is freed on its thread. Settings, a session or a restart take effect
/// at a tick boundary, as TickDriver describes. A watchdog thread releases the forces of the device
/// (Device::releaseForces) if the loop hangs while motors are engaged; after a hang the safety stage reports a fault.
class HapticLoop {
  public:
    /// Starts the ticks. Throws std::invalid_argument with one sentence if checkSettings() finds an error, and
    /// std::system_error if no thread can be created.
    HapticLoop(std::shared_ptr<const World> world, const Settings& settings, std::unique_ptr<Device> device,
               const LoopOptions& options = {});
    /// Stops within a tick and leaves the device with zero force.
    ~HapticLoop();

    /// The newest settings win. Throws std::invalid_argument with one sentence if checkSettings() finds an error.
    void setSettings(const Settings& settings);
    /// Target poses for the obstacles of the newest world, X_WO by obstacle. They move a little in every tick, see
    /// step().
    void moveObstacles(std::span<const Pose> X_WO);
    /// Replaces world, device and settings. A later call of poll() or open() frees the old ones. The calling thread
    /// allocates the tick's memory. The newest call wins. Throws as setSettings() does.
    void open(std::shared_ptr<const World> world, const Settings& settings, std::unique_ptr<Device> device);
    /// Resets device and tool to the start.
    void restart();
    /// As in TickDriver, at the next tick; the newer of the two wins.
    void stop();
    void engage();

    /// Makes the state forget its history at the next tick, whose input then has a start. A recording that begins with
    /// that tick can reproduce the run. The tool continues from its pose, up to rounding. If pop() will not deliver
    /// that tick, since the ring is full, a later one takes its place.
    void forgetHistory();

    /// Takes the newest snapshot; returns false if no tick has ended since the last call. Call it regularly, since it
    /// also frees what the loop has handed back.
    bool poll();
    const LoopSnapshot& snapshot() const;
    /// Whether the watchdog has released the device's forces and no tick has ended since.
    bool hangs() const;
    /// Takes the oldest tick not yet taken; false if there is none. Ticks arrive in order, and without gaps as long as
    /// `dropped` does not change.
    bool pop(RecordedTick& tick);
    bool pop(TickRecord& record);
    /// Poses of the obstacles at the start in the input of the last tick taken; only valid if that input has a start.
    std::span<const Pose> obstaclesAtStart() const;

    /// The real-time properties that the system granted the thread.
    const RealTimeStatus& realTime() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace touchstone
