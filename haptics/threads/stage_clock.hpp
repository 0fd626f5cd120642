#pragma once
// A counter of time that a pure function may be given.
#include <cstdint>

namespace touchstone {

/// Stage times from a counter of the caller's; null gives zeros. Never changes a result.
struct StageClock {
    std::uint64_t (*now)() = nullptr;
    double microseconds = 0;  ///< per count
};

}  // namespace touchstone
