#include "haptics/device/safety.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

// Each line that ends in "guard" is needed: tools/mutate_safety removes these lines one by one, and a test must fail
// each time.

namespace touchstone {
namespace {

constexpr std::array<TripInfo, kTripCount> kTrips = {{
    {"wrench not finite", Follows::Fault, "The tick computed a wrench with NaN or infinity: report the scene."},
    {"solver failed", Follows::Fault,
     "The solver returned no finite solution: choose the exact solver, or report the scene."},
    {"invalid pose", Follows::Fault,
     "The device or a moving obstacle supplied a pose that is not finite or lies beyond 1 km: check the driver or the "
     "file."},
    {"contact list overflow", Follows::Fade, "More pairs are near than the contact list can hold: move back a little."},
    {"device fault", Follows::Fault, "The device reports a fault: see the Device panel."},
    {"device reading stale", Follows::Fade, "The device supplied no fresh pose: its cable or its driver is slow."},
    {"device lost", Follows::Fault, "The device supplied no fresh pose for 100 ms: check its cable."},
    {"late tick", Follows::Fade, "A tick came ten periods late, so the force was outdated: see Late and Priority."},
    {"force clamped", Follows::Limit, "The force is limited to the device's peak."},
    {"torque clamped", Follows::Limit, "The torque is limited to the device's peak."},
    {"force thermally limited", Follows::Limit, "The motors are warm: the force falls toward their continuous limit."},
    {"torque thermally limited", Follows::Limit,
     "The motors are warm: the torque falls toward their continuous limit."},
    {"force slew-rate limited", Follows::Limit,
     "The force grew or turned faster than the device allows: its rate is limited."},
    {"torque slew-rate limited", Follows::Limit,
     "The torque grew or turned faster than the device allows: its rate is limited."},
    {"overload", Follows::Fault, "The wrench exceeded the device's peak for 5 s: move back out of the part."},
    {"buzz", Follows::Fault, "The wrench oscillated faster than a hand can move: lower the stiffness."},
    {"tick hung", Follows::Fault,
     "No tick came for so long that the watchdog released the forces: check the device's driver."},
}};

constexpr std::uint32_t tripsThat(Follows follows) {
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < kTrips.size(); ++i)
        if (kTrips[i].follows == follows) bits |= 1u << i;
    return bits;
}
constexpr std::uint32_t kFaults = tripsThat(Follows::Fault), kZeroing = kFaults | tripsThat(Follows::Fade);

/// hypot does not overflow where the sum of the squares would.
double length(const Vec3& v) { return std::hypot(v.x(), v.y(), v.z()); }

/// Shortens v to the length `limit` and keeps its direction. Torque is also clamped by magnitude, so that no axis of
/// the device exceeds its limit for any orientation of the axes.
bool shorten(Vec3& v, double limit) {
    const double magnitude = length(v);
    if (magnitude <= limit) return false;
    // Keeps the result within the limit despite rounding.
    constexpr double kInside = 1 - 8 * std::numeric_limits<double>::epsilon();
    v = v / magnitude * (limit * kInside);  // the direction comes first, since limit / magnitude could underflow
    return true;
}

/// A usable limit: negative and NaN become 0, as do limits below 1e-9; larger ones are clamped to 1e6. No device is
/// beyond these bounds, and squares of values between them neither overflow nor underflow.
double limitOrZero(double limit) { return limit >= 1e-9 ? std::fmin(limit, 1e6) : 0; }
double fadeOrZero(double fade) { return fade >= 0 ? std::fmin(fade, 1) : 0; }

}  // namespace

const TripInfo& info(Trip trip) { return kTrips[static_cast<std::size_t>(trip)]; }

const char* name(Engagement engagement) {
    constexpr const char* kNames[] = {"stopped", "engaging", "engaged", "faulted"};
    return kNames[static_cast<std::size_t>(engagement)];
}

SafetyStage::SafetyStage(const DeviceLimits& l)
    : motors_(l.motors),
      hasTorque_(l.torque),
      force_{limitOrZero(l.peakForce), limitOrZero(l.continuousForce), limitOrZero(l.slewForce)},
      torque_{limitOrZero(l.peakTorque), limitOrZero(l.continuousTorque), limitOrZero(l.slewTorque)} {
    begin();
}

void SafetyStage::begin() noexcept {
    engagement_ = motors_ ? Engagement::Stopped : Engagement::Engaging;
    waiting_ = motors_;
    staleMs_ = overloadMs_ = 0;
}

void SafetyStage::stop() noexcept {
    if (engagement_ != Engagement::Faulted) engagement_ = Engagement::Stopped;
}

void SafetyStage::engage() noexcept {
    if (isEngaged(engagement_)) return;
    engagement_ = Engagement::Engaging;
    waiting_ = motors_;
}

void SafetyStage::inherit(const SafetyStage& before) noexcept {
    force_.heat = before.force_.heat;
    torque_.heat = before.torque_.heat;
}

bool SafetyStage::Swing::reverses(double x, double swing) {
    if (rising ? x >= extreme : x <= extreme) {
        extreme = x;
        return false;
    }
    if (std::abs(x - extreme) <= swing) return false;
    rising = !rising;
    extreme = x;
    return true;
}

bool SafetyStage::Channel::buzzes(const Vec3& v, double dt) {
    bool reversed = false;
    for (int axis = 0; axis < 3; ++axis) reversed |= swings[axis].reverses(v[axis], kBuzzSwing * peak);
    reversals = reversals * std::exp(-dt / kBuzzMs) + reversed;
    return reversals > kBuzzTurns;
}

/// The limit falls smoothly from the peak, at half the heat that the motors bear, to the continuous limit, at the full
/// heat. The full heat is never exceeded.
double SafetyStage::Channel::thermalLimit(double dt) const {
    if (continuous >= peak) return peak;
    const double kept = std::exp(-dt / kThermalMs), ratio = peak / continuous;
    const double smooth = 1 + (ratio * ratio - 1) * std::min(1.0, 2 * (1 - heat));
    // The squared share with which the heat reaches 1 at the end of this tick. It matters only if dt is long.
    const double left = (1 - kept * heat) / (1 - kept);
    return continuous * std::sqrt(std::max(0.0, std::min(smooth, left)));
}

/// Moves v toward the segment from the last output to zero until its distance from the segment is at most
/// `maxDistance`. The result is never longer than v, so it exceeds no earlier limit. Shortening also brings v nearer to
/// the segment, so a limit that comes later would not violate this one.
bool SafetyStage::Channel::limitSlew(Vec3& v, double maxDistance) const {
    const double squared = last.squaredNorm();
    const Vec3 nearest = (squared > 0 ? std::clamp(v.dot(last) / squared, 0.0, 1.0) : 0.0) * last;
    Vec3 away = v - nearest;
    if (!shorten(away, maxDistance)) return false;
    v = nearest + away;
    return true;
}

void SafetyStage::Channel::warm(double dt) {
    const double kept = std::exp(-dt / kThermalMs), share = continuous > 0 ? length(last) / continuous : 0;
    heat = kept * heat + (1 - kept) * share * share;
}

void SafetyStage::trip(Trip trip, bool acts) {
    if (acts) acting_ |= bit(trip);
}

void SafetyStage::limit(Channel& channel, Vec3& v, int torque, const SafetyInput& in) {
    // The torque's trip follows the force's in the enum.
    const auto tripOf = [&](Trip ofForce, bool acted) { trip(Trip(static_cast<int>(ofForce) + torque), acted); };
    tripOf(Trip::ForceClamped, shorten(v, channel.peak));                                       // guard
    if (motors_) tripOf(Trip::ForceThermallyLimited, shorten(v, channel.thermalLimit(in.dt)));  // guard
    // The fade comes after the clamps, so that a saturated force is faded from its first tick on.
    v *= fadeOrZero(in.fade);                               // guard
    trip(Trip::Buzz, motors_ && channel.buzzes(v, in.dt));  // guard
    // The slew limit is last, because it must hold for the output.
    tripOf(Trip::ForceSlewLimited, channel.limitSlew(v, channel.slew * in.dt));  // guard
}

Wrench SafetyStage::pass(const SafetyInput& in) noexcept {
    const std::uint32_t before = std::exchange(acting_, 0);

    // Is the wrench trustworthy? Every cause is checked, so that each one is counted.
    staleMs_ = in.fresh ? 0 : staleMs_ + in.dt;
    trip(Trip::NotFinite, !in.wrench_o.isFinite());                     // guard
    trip(Trip::SolverFailed, in.solverFailed);                          // guard
    trip(Trip::BadInput, in.badInput);                                  // guard
    trip(Trip::ListOverflow, in.listOverflow);                          // guard
    trip(Trip::DeviceFault, in.fault);                                  // guard
    trip(Trip::StaleReading, !in.fresh);                                // guard
    trip(Trip::DeviceLost, staleMs_ > kLostMs);                         // guard
    trip(Trip::LateTick, motors_ && in.period > kLatePeriods * in.dt);  // guard
    trip(Trip::TickHung, motors_ && in.hung);                           // guard

    Wrench wanted = in.wrench_o;
    if (!hasTorque_) wanted.torque.setZero();  // it cannot be felt, so it is neither limited nor an overload
    bool allowed = (acting_ & kZeroing) == 0;
    allowed &= isEngaged(engagement_);  // guard
    const bool small =
        length(wanted.force) <= kSmallShare * force_.peak && length(wanted.torque) <= kSmallShare * torque_.peak;
    allowed &= small || !waiting_;  // guard

    Wrench out;
    if (allowed) {
        waiting_ = false;
        out = wanted;
        limit(force_, out.force, 0, in);
        limit(torque_, out.torque, 1, in);
    }
    overloadMs_ = acting_ & (bit(Trip::ForceClamped) | bit(Trip::TorqueClamped)) ? overloadMs_ + in.dt : 0;
    trip(Trip::Overload, motors_ && overloadMs_ > kOverloadMs);  // guard

    zeroed_ = !allowed || (acting_ & kZeroing);
    if (zeroed_) out = {};  // guard
    if (acting_ & kFaults) {
        engagement_ = Engagement::Faulted;  // guard
        cause_ = static_cast<Trip>(std::countr_zero(acting_ & kFaults));
    } else if (engagement_ == Engagement::Engaged && zeroed_) {
        engagement_ = Engagement::Engaging;
    } else if (allowed && in.fade >= 1) {
        engagement_ = Engagement::Engaged;
    }
    force_.last = out.force;
    torque_.last = out.torque;
    for (Channel* channel : {&force_, &torque_}) {
        if (motors_) channel->warm(in.dt);
        if (zeroed_) channel->reversals = 0;
    }

    for (int i = 0; i < kTripCount; ++i) {
        counts_[i].ticks += acting_ >> i & 1;
        counts_[i].events += (acting_ & ~before) >> i & 1;
    }
    return out;
}

}  // namespace touchstone
