#pragma once
// A time counter that can be passed to a pure function.
#include <cstdint>

namespace touchstone {

/// The caller's counter for stage times. Without a counter all times are zero. It never changes a result.
struct StageClock {
    std::uint64_t (*now)() = nullptr;
    double microseconds = 0;  ///< duration of one count
};

}  // namespace touchstone
