#pragma once
// Doubles to single precision, rounded for certain.
#include <cmath>
#include <limits>

namespace touchstone {

/// The float nearest to v. It goes through memory: g++ 12 at -O2 drops the rounding where it sees the way back to
/// double.
inline float toSingle(double v) {
    volatile float single = static_cast<float>(v);
    return single;
}

/// A float not below v.
inline float toSingleUp(double v) {
    const float single = toSingle(v);
    return single >= v ? single : std::nextafter(single, std::numeric_limits<float>::infinity());
}

}  // namespace touchstone
