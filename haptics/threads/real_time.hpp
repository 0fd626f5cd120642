#pragma once
// What a real-time thread asks of the system, and what it was granted.
#include <string>

namespace touchstone {

struct RealTimeOptions {
    bool raise = true;  ///< request SCHED_FIFO and locked memory
    int priority = 80;  ///< of SCHED_FIFO, 1 to 99
    int cpu = -1;       ///< processor to which the thread is pinned; -1: any
};

struct RealTimeStatus {
    bool scheduled = false;  ///< the thread runs under SCHED_FIFO
    bool locked = false;     ///< the process's memory stays in RAM
    bool pinned = false;     ///< the thread is pinned to the requested processor
    double share = 1;        ///< of a processor's time that the system leaves to real-time threads; then it stops them
    std::string message;     ///< one sentence with the remedy if a request was refused; otherwise empty
};

/// What the system's limit on real-time threads does to a loop, and the remedy, in two sentences; empty without one.
std::string throttlingWords(const RealTimeStatus& status);

}  // namespace touchstone
