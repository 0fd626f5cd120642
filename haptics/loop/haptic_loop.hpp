#pragma once
// The haptic thread: ticks at a steady rate, fed and watched without a lock.
#include <array>
#include <atomic>
#include <cstdint>
#include <latch>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "haptics/loop/tick_driver.hpp"
#include "haptics/loop/work_limits.hpp"
#include "haptics/threads/mailbox.hpp"
#include "haptics/threads/ring.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "haptics/threads/triple_buffer.hpp"

namespace touchstone {

struct LoopOptions {
    RealTimeOptions realTime;
    std::size_t ringCapacity = 1 << 14;  ///< ticks: 16 s at 1 kHz
    WorkShares shares;
    bool helper = std::thread::hardware_concurrency() > 1;  ///< a thread beside it finds lists ahead
    double watchdogMs = 250;  ///< without a tick, until a device whose motors are engaged is let go of; 0: never
};

/// The newest tick and the loop's health.
struct LoopSnapshot {
    TickRecord record;
    std::vector<Pose> X_WO;                     ///< where the obstacles are after it
    Settings settings;                          ///< in force, with the work limits of this machine
    std::uint64_t session = 0;                  ///< 0 for the first, one more with each open()
    std::uint64_t ticks = 0;                    ///< since the loop began
    std::uint64_t overruns = 0;                 ///< ticks that ended after their deadline
    std::uint64_t dropped = 0;                  ///< records lost to a full ring
    double rate = 0;                            ///< measured over the last quarter of a second, Hz; 0 before
    double fade = 0;                            ///< share of the force let through for a fade, 0 to 1
    bool finished = false;                      ///< the device's motion has ended
    std::array<TripCount, kTripCount> trips{};  ///< of the session's safety stage, by Trip; record.trips acted now
    Engagement engagement = Engagement::Stopped;
    Trip cause = Trip::NotFinite;  ///< of the fault, while faulted
};

/// Owns the thread, the tick's state and the device. All functions are for one other thread (the view's), none blocks,
/// and nothing given to the loop is freed on it. Settings, a session or a restart act at a tick boundary as TickDriver
/// says. A second thread lets go of the device (Device::releaseForces) when the first hangs while motors are engaged;
/// should that go on, the safety stage takes it for a fault.
class HapticLoop {
  public:
    /// Starts ticking. Throws std::invalid_argument with one sentence when checkSettings() objects, std::system_error
    /// when no thread can be made.
    HapticLoop(std::shared_ptr<const World> world, const Settings& settings, std::unique_ptr<Device> device,
               const LoopOptions& options = {});
    /// Stops within a tick; the device is left with zero force.
    ~HapticLoop();

    /// Newest wins. Throws std::invalid_argument with one sentence when checkSettings() objects.
    void setSettings(const Settings& settings);
    /// Where the obstacles of the newest world are to go, X_WO by obstacle: a little in every tick, see step().
    void moveObstacles(std::span<const Pose> X_WO);
    /// Another world, device and settings in place of the present ones, which are freed by a later call of poll() or
    /// open(). The tick's memory is made here, on the calling thread. Newest wins. Throws as setSettings().
    void open(std::shared_ptr<const World> world, const Settings& settings, std::unique_ptr<Device> device);
    /// Device and tool back to the start.
    void restart() { restart_.store(true, std::memory_order_relaxed); }
    /// As TickDriver's, at the next tick; of the two the newest wins.
    void stop() { asked_.store(Asked::Stop, std::memory_order_relaxed); }
    void engage() { asked_.store(Asked::Engage, std::memory_order_relaxed); }

    /// The state forgets what it may: from the tick whose input tells a start, a recording can repeat the run. The tool
    /// goes on from where it is, to rounding.
    void beginAnew() { beginAnew_.store(true, std::memory_order_relaxed); }

    /// Takes the newest snapshot; false if no tick has ended since the last call. Call it regularly: it also frees what
    /// the loop has handed back.
    bool poll();
    const LoopSnapshot& snapshot() const { return snapshots_.get(); }
    /// The device was let go of for want of ticks, and none has come since.
    bool hangs() const { return hangs_.load(std::memory_order_relaxed); }
    /// The oldest tick not yet taken, in order and without gaps while `dropped` stays the same; false when there is
    /// none.
    bool pop(RecordedTick& tick);
    bool pop(TickRecord& record);
    /// Where the obstacles were at the start that the tick taken last tells; meaningless where it tells none.
    std::span<const Pose> obstaclesAtStart() const { return start_.X_WO; }

    /// What the system allowed the thread.
    const RealTimeStatus& realTime() const { return realTime_; }

  private:
    /// What the view wants of a session, which it names: the two arrive by different ways.
    struct PendingRequests {
        Settings settings;
        std::vector<Pose> X_WO;  ///< where obstacles are to go; empty: where they are
        std::uint64_t session = 0;
    };

    /// Where the obstacles were when a state began: too much for every tick to carry.
    struct StartPlaces {
        std::uint64_t number = 0;
        std::vector<Pose> X_WO;
    };

    Settings checked(const Settings& settings) const;
    std::unique_ptr<Session> makeSession(std::shared_ptr<const World> world, const Settings& settings,
                                         std::unique_ptr<Device> device) const;
    void run(const std::stop_token& stop);
    void watch(const std::stop_token& stop);
    void freeRetired();
    void takeRequests();
    void hand(const TickRecord& record);

    const LoopOptions options_;
    const double nanosecondsPerRowIteration_;
    PendingRequests newest_;   // the view's: of the newest session
    RealTimeStatus realTime_;  // written before ready_
    std::latch ready_{1};

    TripleBuffer<PendingRequests> wishes_;
    bool wishesWait_ = false;  // the loop's: the newest are for a session still to come
    std::atomic<bool> restart_ = false, beginAnew_ = false;
    enum class Asked : std::uint8_t { Nothing, Stop, Engage };
    std::atomic<Asked> asked_ = Asked::Nothing;
    Mailbox<Session> incoming_, outgoing_;
    TripleBuffer<LoopSnapshot> snapshots_;  // with room for all obstacles that a world can have
    Ring<RecordedTick> ring_;
    Ring<StartPlaces> starts_;  // of ticks in ring_, in their order
    StartPlaces start_;         // the view's: of the tick taken last
    StartPlaces begun_;         // the loop's: the next for starts_
    TickDriver driver_;         // the loop's

    std::mutex freeing_;                      // of sessions; against watch(), never the loop's
    std::atomic<Device*> engaged_ = nullptr;  // the session's, while its motors are
    std::atomic<std::uint64_t> ticks_ = 0;
    std::atomic<bool> hung_ = false, hangs_ = false;
    std::jthread watchdog_;
    std::jthread thread_;  // last: joined, and watched until then, before anything it uses goes
};

}  // namespace touchstone
