#pragma once
// The safety stage before every device. The output of pass() is finite, within all limits, grows no faster than the
// device allows, and is zero in case of doubt. docs/safety.md gives the reason for each guard.
#include <array>
#include <cstdint>

#include "haptics/device/device.hpp"
#include "haptics/device/trips.hpp"
#include "haptics/math/rigid.hpp"

namespace touchstone {

struct SafetyInput {
    Wrench wrench_o;            ///< wrench of the tick on the hand, about the tool node's origin
    bool solverFailed = false;  ///< the result of the tick was not finite
    bool badInput = false;      ///< the tick received an invalid pose
    bool listOverflow = false;  ///< the neighbor lists were full
    bool fresh = true;          ///< the device's reading was valid
    bool fault = false;         ///< the device reports a fault
    bool hung = false;          ///< no tick came for so long that the watchdog released the forces
    double fade = 1;            ///< factor on the wrench, 0 to 1
    double dt = 1;              ///< nominal time between ticks, ms; positive
    double period = 0;          ///< measured time since the previous tick, ms; 0 if it is not measured
};

/// Applies the guards in a fixed order. To add a guard, add a Trip with its row and a line in pass(). A device with
/// motors begins stopped, any other device begins engaging. Real time: no allocation, lock, log or throw.
class SafetyStage {
  public:
    static constexpr double kLostMs = 100;        ///< time without a fresh reading after which the device is lost
    static constexpr double kLatePeriods = 10;    ///< tick period, in nominal periods, above which a tick is late
    static constexpr double kOverloadMs = 5000;   ///< maximum time of a force above the peak
    static constexpr double kSmallShare = 0.05;   ///< share of the peak below which engaging begins
    static constexpr double kThermalMs = 30'000;  ///< time constant of a motor's winding
    static constexpr double kBuzzSwing = 0.1;     ///< least swing between reversals that count, as a share of the peak
    static constexpr double kBuzzMs = 100;        ///< time constant with which counted reversals are forgotten
    static constexpr double kBuzzTurns = 8;       ///< reversals that are a buzz: 40 Hz if it lasts, 200 Hz within 25 ms

    /// A limit that is negative or NaN blocks every wrench.
    explicit SafetyStage(const DeviceLimits& limits);

    /// Returns the wrench for the device. For any input and up to rounding, it is finite, |force| <= peakForce and
    /// |torque| <= peakTorque. With motors, the mean squares over kThermalMs are within the continuous limits. Its
    /// distance from the segment between the last output and zero is at most slew × dt, so it may fall to zero
    /// immediately.
    Wrench pass(const SafetyInput& input) noexcept;

    void stop() noexcept;    ///< zero from the next pass() on; a fault remains a fault
    void engage() noexcept;  ///< does nothing if it is engaging or engaged
    void begin() noexcept;   ///< returns to the initial engagement; counts and heat stay
    /// Takes the heat of the motors from the previous stage.
    void inherit(const SafetyStage& before) noexcept;

    bool motors() const { return motors_; }
    Engagement engagement() const { return engagement_; }
    /// The trip of the last fault; meaningful while Faulted.
    Trip cause() const { return cause_; }
    /// Whether the last pass() returned zero because of a trip or because the stage is not engaged.
    bool zeroed() const { return zeroed_; }
    /// The guards that acted in the last pass(), as bits; see bit().
    std::uint32_t acting() const { return acting_; }
    bool active(Trip trip) const { return (acting_ & bit(trip)) != 0; }
    const TripCount& count(Trip trip) const { return counts_[static_cast<std::size_t>(trip)]; }
    const std::array<TripCount, kTripCount>& counts() const { return counts_; }

  private:
    /// Detects reversals of a value that swings far enough.
    struct Swing {
        double extreme = 0;
        bool rising = true;
        bool reverses(double x, double swing);
    };
    /// The force or the torque: its limits and the history of its output.
    struct Channel {
        double peak, continuous, slew;  // N, N, N/ms or mN·m, mN·m, mN·m/ms
        Vec3 last = Vec3::Zero();       // the last output
        double heat = 0;                // mean square of the output over kThermalMs, in units of continuous²
        std::array<Swing, 3> swings{};
        double reversals = 0;  // exponentially forgotten count

        double thermalLimit(double dt) const;
        bool buzzes(const Vec3& v, double dt);
        bool limitSlew(Vec3& v, double maxDistance) const;
        void warm(double dt);
    };

    void trip(Trip trip, bool acts);
    void limit(Channel& channel, Vec3& v, int torque, const SafetyInput& input);

    const bool motors_, hasTorque_;
    Channel force_, torque_;
    Engagement engagement_;
    bool waiting_;  // engaging begins only after a small force was requested
    Trip cause_ = Trip::NotFinite;
    double staleMs_ = 0, overloadMs_ = 0;
    std::uint32_t acting_ = 0;
    std::array<TripCount, kTripCount> counts_{};
    bool zeroed_ = true;
};

}  // namespace touchstone
