#pragma once
// What the safety stage reports: the guards that acted, and whether the device is engaged.
#include <cstdint>

namespace touchstone {

/// The reasons why the safety stage changes a wrench.
enum class Trip : std::uint8_t {
    NotFinite,
    SolverFailed,
    BadInput,
    ListOverflow,
    DeviceFault,
    StaleReading,
    DeviceLost,
    LateTick,
    ForceClamped,  // each limit of the force is followed by the same limit of the torque
    TorqueClamped,
    ForceThermallyLimited,
    TorqueThermallyLimited,
    ForceSlewLimited,
    TorqueSlewLimited,
    Overload,
    Buzz,
    TickHung,
};
inline constexpr int kTripCount = 17;

/// The consequence of a trip.
enum class Follows : std::uint8_t {
    Limit,  ///< the wrench is reduced
    Fade,   ///< the wrench is zero while the trip lasts, then it fades in
    Fault,  ///< the wrench is zero until the user engages again
};
struct TripInfo {
    const char* name;
    Follows follows;
    const char* why;  ///< one sentence: what happened, and what to do
};
const TripInfo& info(Trip trip);
inline const char* name(Trip trip) { return info(trip).name; }
/// The bit of a trip in TickRecord::trips.
constexpr std::uint32_t bit(Trip trip) { return 1u << static_cast<int>(trip); }

enum class Engagement : std::uint8_t {
    Stopped,   ///< zero force, and the tool is held until engage()
    Engaging,  ///< the force fades in; with motors, only after the requested force was small
    Engaged,
    Faulted,  ///< zero force until engage(); the tool keeps moving
};
const char* name(Engagement engagement);
/// Whether the stage is engaging or engaged.
constexpr bool isEngaged(Engagement e) { return e == Engagement::Engaging || e == Engagement::Engaged; }

/// How often a guard acted: `events` counts the uninterrupted sequences of ticks, `ticks` counts every tick.
struct TripCount {
    std::uint64_t events = 0;
    std::uint64_t ticks = 0;
};

}  // namespace touchstone
