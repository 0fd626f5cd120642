#pragma once
// Real-time threads: priority, pacing and clocks.
#include <cstdint>

#include "haptics/threads/real_time.hpp"
#include "haptics/threads/stage_clock.hpp"

namespace touchstone {

/// Makes the calling thread a real-time thread as far as the system permits. It never fails; the status reports what
/// was refused.
RealTimeStatus raiseThread(const RealTimeOptions& options);

/// Returns the memory that the process has freed to the system, locked or not. Takes tens of milliseconds: call it
/// where much was freed, never in a tick.
void returnFreedMemory();

/// Computes when ticks begin: the arithmetic of Pacer without a clock. A tick that ends after its deadline is late. The
/// next tick then begins at once and all deadlines shift, so that a late tick is not followed by a burst of ticks.
class TickSchedule {
  public:
    /// Times are in ns on any steady clock. The first tick begins at `now`.
    TickSchedule(double rateHz, std::uint64_t now);
    /// Call it when a tick has ended at `now`. Returns when the next tick begins.
    std::uint64_t endTick(std::uint64_t now);
    void setRate(double rateHz);                          ///< applies from the next endTick() on
    std::uint64_t overruns() const { return overruns_; }  ///< number of late ticks

  private:
    double period_;  // ns
    double begin_;   // of the present tick, relative to origin_; a double, since fractions of ns add up over a long run
    std::uint64_t origin_;
    std::uint64_t overruns_ = 0;
};

/// Paces the calling thread: it sleeps until shortly before a tick and then spins. Use spinning only under SCHED_FIFO:
/// without it the scheduler preempts spinning threads, and sleeping is more punctual.
class Pacer {
  public:
    Pacer(double rateHz, bool spin);
    /// Call it at the end of each tick; it returns when the next tick begins.
    void wait();
    void setRate(double rateHz) { schedule_.setRate(rateHz); }
    std::uint64_t overruns() const { return schedule_.overruns(); }

  private:
    TickSchedule schedule_;
    bool spin_;
};

/// Steady clock, ns.
std::uint64_t steadyNanoseconds();
/// Processor time of the calling thread, µs. Costs about 0.35 µs.
double threadCpuMicroseconds();
/// The processor's cycle counter, or the steady clock in ns if there is none. A call takes a few ns; the rate is
/// constant.
std::uint64_t cycleCount();
/// cycleCount() with its rate, which is measured once in a process (10 ms at the first call).
StageClock stageClock();

}  // namespace touchstone
