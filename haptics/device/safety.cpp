#include "haptics/device/safety.hpp"

#include <cmath>
#include <limits>

#include "haptics/loop/step.hpp"

namespace touchstone {
namespace {

using Acting = std::array<bool, kTripCount>;

/// Something is wrong with the tick or the device: there is no force to trust.
bool zeroOnFailure(const SafetyInput& input, Acting& acting) {
    const auto trip = [&](Trip which, bool wrong) {
        acting[static_cast<int>(which)] = wrong;
        return wrong;
    };
    // Every cause is looked at, so that each is counted.
    bool wrong = trip(Trip::NotFinite, !input.wrench_o.isFinite());
    wrong |= trip(Trip::SolverFailed, input.flags & kNonFinite);
    wrong |= trip(Trip::BadInput, input.flags & kBadInput);
    wrong |= trip(Trip::ListOverflow, input.flags & kListOverflow);
    wrong |= trip(Trip::StaleReading, !input.fresh);
    return wrong;
}

/// Shortens v to `peak`, its direction kept. Torque is clamped by magnitude too: whatever way the device's axes are
/// turned, none then gets more than its limit.
bool clampMagnitude(Vec3& v, double peak) {
    // hypot does not overflow where the sum of squares would; direction first, since peak / magnitude could underflow.
    const double magnitude = std::hypot(v.x(), v.y(), v.z());
    if (magnitude <= peak) return false;
    constexpr double kInside = 1 - 8 * std::numeric_limits<double>::epsilon();  // so that rounding does not exceed it
    v = v / magnitude * (peak * kInside);
    return true;
}

double limitOrZero(double limit) { return limit >= 0 ? limit : 0; }
double shareOrZero(double fade) { return fade >= 0 ? std::fmin(fade, 1) : 0; }

}  // namespace

const char* name(Trip trip) {
    switch (trip) {
        case Trip::NotFinite:
            return "wrench not finite";
        case Trip::SolverFailed:
            return "solver failed";
        case Trip::BadInput:
            return "device pose not finite";
        case Trip::ListOverflow:
            return "contact list overflow";
        case Trip::StaleReading:
            return "device reading stale";
        case Trip::ForceClamped:
            return "force clamped";
        case Trip::TorqueClamped:
            return "torque clamped";
    }
    return "unknown";
}

SafetyStage::SafetyStage(const DeviceLimits& limits)
    : limits_{limitOrZero(limits.peakForce), limitOrZero(limits.peakTorque)} {}

Wrench SafetyStage::pass(const SafetyInput& input) noexcept {
    Acting acting{};
    Wrench out = input.wrench_o;

    zeroed_ = zeroOnFailure(input, acting);
    if (zeroed_) {
        out = {};
    } else {
        acting[index(Trip::ForceClamped)] = clampMagnitude(out.force, limits_.peakForce);
        acting[index(Trip::TorqueClamped)] = clampMagnitude(out.torque, limits_.peakTorque);
        // After the clamp, so that a saturated force fades from its first tick on.
        const double share = shareOrZero(input.fade);
        out.force *= share;
        out.torque *= share;
    }

    for (int i = 0; i < kTripCount; ++i) {
        counts_[i].ticks += acting[i];
        counts_[i].events += acting[i] && !acting_[i];
    }
    acting_ = acting;
    return out;
}

}  // namespace touchstone
