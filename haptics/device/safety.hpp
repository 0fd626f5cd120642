#pragma once
// The last word before a device: what leaves pass() is finite, within every limit, grows no faster than the device
// allows, and is zero when in doubt. docs/safety.md tells each guard's reason.
#include <array>
#include <cstdint>

#include "haptics/device/device.hpp"
#include "haptics/math/rigid.hpp"

namespace touchstone {

/// Why the stage changed a wrench.
enum class Trip : std::uint8_t {
    NotFinite,
    SolverFailed,
    BadInput,
    ListOverflow,
    DeviceFault,
    StaleReading,
    DeviceLost,
    LateTick,
    ForceClamped,  // a limit of force is followed by the same of torque
    TorqueClamped,
    ForceHeld,
    TorqueHeld,
    ForceSlewed,
    TorqueSlewed,
    Overload,
    Buzz,
    TickHung,
};
inline constexpr int kTripCount = 17;

/// What a trip does.
enum class Follows : std::uint8_t {
    Limit,  ///< the wrench goes out smaller
    Fade,   ///< zero while it lasts, then the force fades in
    Fault,  ///< zero until somebody engages anew
};
struct TripInfo {
    const char* name;
    Follows follows;
    const char* why;  ///< one sentence: what happened, and what to do
};
const TripInfo& info(Trip trip);
inline const char* name(Trip trip) { return info(trip).name; }
/// Of TickRecord::trips.
constexpr std::uint32_t bit(Trip trip) { return 1u << static_cast<int>(trip); }

enum class Engagement : std::uint8_t {
    Stopped,   ///< zero force and the tool held until engage()
    Engaging,  ///< the force fades in, with motors only once a small one is asked for
    Engaged,
    Faulted,  ///< zero force until engage(); the tool goes on
};
const char* name(Engagement engagement);
/// Engaging or engaged.
constexpr bool isEngaged(Engagement e) { return e == Engagement::Engaging || e == Engagement::Engaged; }

/// How often a guard acted: `events` counts beginnings, `ticks` every tick.
struct TripCount {
    std::uint64_t events = 0;
    std::uint64_t ticks = 0;
};

struct SafetyInput {
    Wrench wrench_o;            ///< the tick's, on the hand about the tool node's origin
    bool solverFailed = false;  ///< the answer of the tick was not finite
    bool badInput = false;      ///< the tick was given an invalid pose
    bool listOverflow = false;  ///< neighbor lists were full
    bool fresh = true;          ///< the device's reading was valid
    bool fault = false;         ///< the device says that it has failed
    bool hung = false;          ///< so long without a tick that the device was let go of
    double fade = 1;            ///< share of the wrench to let through, 0 to 1
    double dt = 1;              ///< nominal time between ticks, ms; positive
    double period = 0;          ///< that by the clock since the tick before, ms; 0 where nobody measures
};

/// Guards in a fixed order; a new one is a Trip with its row and a line of pass(). A device with motors begins stopped,
/// any other engaging. Real time: no allocation, lock, log or throw.
class SafetyStage {
  public:
    static constexpr double kLostMs = 100;        ///< without a fresh reading, until the device counts as lost
    static constexpr double kLatePeriods = 10;    ///< from tick to tick, in nominal ones, that is too late
    static constexpr double kOverloadMs = 5000;   ///< of pressing beyond the peak
    static constexpr double kSmallShare = 0.05;   ///< of the peak: engaging begins below it
    static constexpr double kThermalMs = 30'000;  ///< time constant of a motor's winding
    static constexpr double kBuzzSwing = 0.1;     ///< of the peak, between turns that count
    static constexpr double kBuzzMs = 100;        ///< in which turns are counted, exponentially forgotten
    static constexpr double kBuzzTurns = 8;       ///< so many are a buzz: 40 Hz if it lasts, 200 Hz within 25 ms

    /// A limit that is negative or not a number lets nothing through.
    explicit SafetyStage(const DeviceLimits& limits);

    /// The wrench for the device. For any input, to rounding: finite, |force| <= peakForce, |torque| <= peakTorque;
    /// with motors their mean squares over kThermalMs within the continuous limits; and no further from the way from
    /// the last wrench to zero than slew × dt, so that it may fall to zero at once.
    Wrench pass(const SafetyInput& input) noexcept;

    void stop() noexcept;    ///< zero from the next pass() on; a fault stays one
    void engage() noexcept;  ///< does nothing where it is engaged
    void begin() noexcept;   ///< as at the start, but for counts and heat
    /// The motors stay as warm as the other stage left them.
    void inherit(const SafetyStage& before) noexcept;

    bool motors() const { return motors_; }
    Engagement engagement() const { return engagement_; }
    /// Of the last fault; meaningful while Faulted.
    Trip cause() const { return cause_; }
    /// The last pass() let nothing through, because something was wrong or the stage is not engaged.
    bool zeroed() const { return zeroed_; }
    /// The guards that acted in the last pass(), by bit().
    std::uint32_t acting() const { return acting_; }
    bool active(Trip trip) const { return (acting_ & bit(trip)) != 0; }
    const TripCount& count(Trip trip) const { return counts_[static_cast<std::size_t>(trip)]; }
    const std::array<TripCount, kTripCount>& counts() const { return counts_; }

  private:
    /// Turns of a value that swings far enough.
    struct Swing {
        double extreme = 0;
        bool rising = true;
        bool turns(double x, double swing);
    };
    /// One of force and torque: its limits, and what the hand got so far.
    struct Channel {
        double peak, continuous, slew;  // N, N, N/ms or mN·m, mN·m, mN·m/ms
        Vec3 last = Vec3::Zero();       // what went out
        double heat = 0;                // mean square of that over kThermalMs, of continuous²
        std::array<Swing, 3> swings{};
        double turns = 0;

        double heldTo(double dt) const;
        bool buzzes(const Vec3& v, double dt);
        bool limitSlew(Vec3& v, double most) const;
        void warm(double dt);
    };

    void trip(Trip trip, bool acts);
    void limit(Channel& channel, Vec3& v, int torque, const SafetyInput& input);

    const bool motors_;
    Channel force_, torque_;
    Engagement engagement_;
    bool waiting_;  // for a small force, before the engaging begins
    Trip cause_ = Trip::NotFinite;
    double staleMs_ = 0, overloadMs_ = 0;
    std::uint32_t acting_ = 0;
    std::array<TripCount, kTripCount> counts_{};
    bool zeroed_ = true;
};

}  // namespace touchstone
