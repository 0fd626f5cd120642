#pragma once
// How far apart ticks are.
#include <utility>

#include "haptics/threads/rt_thread.hpp"

namespace touchstone {

/// Measures the time from the begin of one tick to the next.
class TickPeriod {
  public:
    /// Call it when a tick begins. Returns the ms since the one before began; 0 in the first.
    double begin() {
        const std::uint64_t now = steadyNanoseconds(), before = std::exchange(before_, now);
        return before == 0 ? 0 : 1e-6 * static_cast<double>(now - before);
    }

  private:
    std::uint64_t before_ = 0;
};

}  // namespace touchstone
