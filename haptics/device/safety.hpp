#pragma once
// The last word before a device: what leaves pass() is finite, within the device's limits, and zero when in doubt.
#include <array>
#include <cstdint>

#include "haptics/device/device.hpp"
#include "haptics/math/rigid.hpp"

namespace touchstone {

/// Why the stage changed a wrench. Those up to StaleReading set it to zero.
enum class Trip : std::uint8_t {
    NotFinite,      ///< the wrench was not finite
    SolverFailed,   ///< the tick's answer was not finite
    BadInput,       ///< the device's pose was not finite
    ListOverflow,   ///< more near pairs than memory
    StaleReading,   ///< the device gave no fresh pose
    ForceClamped,   ///< above the device's peak force
    TorqueClamped,  ///< above the device's peak torque
};
inline constexpr int kTripCount = 7;
const char* name(Trip trip);

/// How often a guard acted: `events` counts beginnings, `ticks` every tick.
struct TripCount {
    std::uint64_t events = 0;
    std::uint64_t ticks = 0;
};

struct SafetyInput {
    Wrench wrench_o;          ///< the tick's, on the hand about the tool node's origin
    std::uint32_t flags = 0;  ///< TickFlag bits
    bool fresh = true;        ///< the device's reading was valid
    double fade = 1;          ///< share of the wrench to let through, 0 to 1
};

/// Guards in a fixed order, each a function of safety.cpp; a new guard is a new Trip and a new line in pass().
/// Real time: no allocation, lock, log or throw.
class SafetyStage {
  public:
    /// A limit that is negative or not a number lets nothing through.
    explicit SafetyStage(const DeviceLimits& limits);

    /// The wrench for the device. For any bits of input: finite, |force| <= peakForce, |torque| <= peakTorque (to
    /// rounding).
    Wrench pass(const SafetyInput& input) noexcept;

    /// The last pass() let nothing through because something was wrong (a fade to zero is not).
    bool zeroed() const { return zeroed_; }
    /// The guard acted in the last pass().
    bool active(Trip trip) const { return acting_[index(trip)]; }
    const TripCount& count(Trip trip) const { return counts_[index(trip)]; }
    const std::array<TripCount, kTripCount>& counts() const { return counts_; }

  private:
    static int index(Trip trip) { return static_cast<int>(trip); }

    DeviceLimits limits_;
    std::array<TripCount, kTripCount> counts_{};
    std::array<bool, kTripCount> acting_{};
    bool zeroed_ = false;
};

}  // namespace touchstone
