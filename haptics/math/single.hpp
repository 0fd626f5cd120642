#pragma once
// Conversion of doubles to single precision with guaranteed rounding.
#include <cmath>
#include <limits>

namespace touchstone {

/// The float nearest to v. The value goes through memory, since g++ 12 at -O2 omits the rounding if the float is
/// converted back to double.
inline float toSingle(double v) {
    volatile float single = static_cast<float>(v);
    return single;
}

/// The smallest float that is not below v.
inline float toSingleUp(double v) {
    const float single = toSingle(v);
    return single >= v ? single : std::nextafter(single, std::numeric_limits<float>::infinity());
}

}  // namespace touchstone
