#pragma once
// Wall-clock and processor time of a piece of work.
#include <time.h>

#include <chrono>

namespace touchstone::app {

/// Wall-clock time, and CPU time of all threads of the program.
class Stopwatch {
  public:
    double wall() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - wallStart_).count(); }
    double cpu() const { return cpuNow() - cpuStart_; }

  private:
    static double cpuNow() {
        timespec now{};
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
        return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
    }
    std::chrono::steady_clock::time_point wallStart_ = std::chrono::steady_clock::now();
    double cpuStart_ = cpuNow();
};

}  // namespace touchstone::app
