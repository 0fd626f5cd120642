#pragma once
// Threads that keep time: priority, pacing and clocks.
#include <cstdint>
#include <string>

#include "haptics/threads/stage_clock.hpp"

namespace touchstone {

struct RealTimeOptions {
    bool raise = true;  ///< ask for SCHED_FIFO and locked memory
    int priority = 80;  ///< of SCHED_FIFO, 1 to 99
    int cpu = -1;       ///< processor to stay on; -1 for any
};

struct RealTimeStatus {
    bool scheduled = false;  ///< the thread runs under SCHED_FIFO
    bool locked = false;     ///< the process's memory stays in RAM
    bool pinned = false;     ///< the thread stays on the asked processor
    std::string message;     ///< one sentence with the remedy when something asked for was refused; else empty
};

/// Makes the calling thread a real-time thread as far as the system permits. Never fails: what is refused is told.
RealTimeStatus raiseThread(const RealTimeOptions& options);

/// When ticks begin: the arithmetic of Pacer, without a clock. A tick that ends after its deadline is an overrun; the
/// next then begins at once and the deadlines move, so that late ticks never come in a burst.
class TickSchedule {
  public:
    /// Times in ns on any steady clock. The first tick begins at `now`.
    TickSchedule(double rateHz, std::uint64_t now);
    /// The tick that ran ended at `now`: when the next begins.
    std::uint64_t endTick(std::uint64_t now);
    void setRate(double rateHz);  ///< from the next endTick() on
    std::uint64_t overruns() const { return overruns_; }

  private:
    double period_;  // ns
    double begin_;   // of the present tick, relative to origin_; fractions of ns add up over a long run
    std::uint64_t origin_;
    std::uint64_t overruns_ = 0;
};

/// Paces the calling thread: sleeps until shortly before a tick, then spins. Spinning is for SCHED_FIFO only; without
/// it the scheduler takes spinners off the processor and sleeping is more punctual.
class Pacer {
  public:
    Pacer(double rateHz, bool spin);
    /// To be called at the end of each tick: returns when the next begins.
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
/// Processor's cycle counter (the steady clock in ns where there is none): a few ns a call, constant rate.
std::uint64_t cycleCount();
/// cycleCount with its rate, measured once per process (10 ms at the first call).
StageClock stageClock();

}  // namespace touchstone
