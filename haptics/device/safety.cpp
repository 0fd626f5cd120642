#include "haptics/device/safety.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

// Lines that end in "guard" are each proven to be needed: tools/mutate_safety takes them out one by one, and a test
// must fail.

namespace touchstone {
namespace {

constexpr std::array<TripInfo, kTripCount> kTrips = {{
    {"wrench not finite", Follows::Fault, "The tick gave a wrench that is no number: report the scene."},
    {"solver failed", Follows::Fault, "The solver gave no finite answer: take the exact one, or report the scene."},
    {"invalid pose", Follows::Fault,
     "The device, or who moves obstacles, gave a pose that is not finite or beyond 1 km: look at its driver or file."},
    {"contact list overflow", Follows::Fade, "More pairs are near than there is memory for: go back a little."},
    {"device fault", Follows::Fault, "The device says that it has failed: look at its panel."},
    {"device reading stale", Follows::Fade, "The device gave no fresh pose: its cable or its driver is slow."},
    {"device lost", Follows::Fault, "The device gave no fresh pose for 100 ms: look at its cable."},
    {"tick late", Follows::Fade, "A tick came ten periods late, so its force was old: see Late and Priority."},
    {"force clamped", Follows::Limit, "The force is cut to what the device can give."},
    {"torque clamped", Follows::Limit, "The torque is cut to what the device can give."},
    {"force held to continuous", Follows::Limit,
     "The motors are warm: the force goes down to what they bear for long."},
    {"torque held to continuous", Follows::Limit, "The motors are warm: the torque goes down to what they bear."},
    {"force slewed", Follows::Limit, "The force grew or turned faster than the device may: it follows."},
    {"torque slewed", Follows::Limit, "The torque grew or turned faster than the device may: it follows."},
    {"overload", Follows::Fault, "More than the device can give was asked for during 5 s: go back out of the part."},
    {"buzz", Follows::Fault, "The force swung to and fro faster than a hand can: lower the stiffness."},
    {"tick hung", Follows::Fault, "No tick came for so long that the device was told to let go: look at its driver."},
}};

constexpr std::uint32_t tripsThat(Follows follows) {
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < kTrips.size(); ++i)
        if (kTrips[i].follows == follows) bits |= 1u << i;
    return bits;
}
constexpr std::uint32_t kFaults = tripsThat(Follows::Fault), kZeroing = kFaults | tripsThat(Follows::Fade);

double length(const Vec3& v) { return std::hypot(v.x(), v.y(), v.z()); }  // does not overflow where squares would

/// Shortens v to `limit`, its direction kept. Torque is clamped by magnitude too: whatever way the device's axes are
/// turned, none then gets more than its limit.
bool shorten(Vec3& v, double limit) {
    const double magnitude = length(v);
    if (magnitude <= limit) return false;
    constexpr double kInside = 1 - 8 * std::numeric_limits<double>::epsilon();  // so that rounding does not exceed it
    v = v / magnitude * (limit * kInside);  // direction first, since limit / magnitude could underflow
    return true;
}

/// No device is stronger than 1e6 or finer than 1e-9; the squares of what lies between are ordinary numbers.
double limitOrZero(double limit) { return limit >= 1e-9 ? std::fmin(limit, 1e6) : 0; }
double shareOrZero(double fade) { return fade >= 0 ? std::fmin(fade, 1) : 0; }

}  // namespace

const TripInfo& info(Trip trip) { return kTrips[static_cast<std::size_t>(trip)]; }

const char* name(Engagement engagement) {
    constexpr const char* kNames[] = {"stopped", "engaging", "engaged", "faulted"};
    return kNames[static_cast<std::size_t>(engagement)];
}

SafetyStage::SafetyStage(const DeviceLimits& l)
    : motors_(l.motors),
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

bool SafetyStage::Swing::turns(double x, double swing) {
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
    bool turned = false;
    for (int axis = 0; axis < 3; ++axis) turned |= swings[axis].turns(v[axis], kBuzzSwing * peak);
    turns = turns * std::exp(-dt / kBuzzMs) + turned;
    return turns > kBuzzTurns;
}

/// The limit falls smoothly from the peak at half the heat that the motors bear to the continuous one at the whole,
/// which is never exceeded.
double SafetyStage::Channel::heldTo(double dt) const {
    if (continuous >= peak) return peak;
    const double kept = std::exp(-dt / kThermalMs), ratio = peak / continuous;
    const double smooth = 1 + (ratio * ratio - 1) * std::min(1.0, 2 * (1 - heat));
    const double left = (1 - kept * heat) / (1 - kept);  // what this tick may add, should dt be long
    return continuous * std::sqrt(std::max(0.0, std::min(smooth, left)));
}

/// Moves v towards the way from the last wrench to zero until it is within `most` of it. It never ends further out than
/// v was, so that no limit before is exceeded by it; and since what is shortened also comes nearer to that way, no
/// limit after would undo it.
bool SafetyStage::Channel::limitSlew(Vec3& v, double most) const {
    const double squared = last.squaredNorm();
    const Vec3 nearest = (squared > 0 ? std::clamp(v.dot(last) / squared, 0.0, 1.0) : 0.0) * last;
    Vec3 away = v - nearest;
    if (!shorten(away, most)) return false;
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
    const auto acts = [&](Trip ofForce, bool did) { trip(Trip(static_cast<int>(ofForce) + torque), did); };
    acts(Trip::ForceClamped, shorten(v, channel.peak));                     // guard
    if (motors_) acts(Trip::ForceHeld, shorten(v, channel.heldTo(in.dt)));  // guard
    // After the clamps, so that a saturated force fades from its first tick on.
    v *= shareOrZero(in.fade);                              // guard
    trip(Trip::Buzz, motors_ && channel.buzzes(v, in.dt));  // guard
    // Last, because it binds what the hand gets.
    acts(Trip::ForceSlewed, channel.limitSlew(v, channel.slew * in.dt));  // guard
}

Wrench SafetyStage::pass(const SafetyInput& in) noexcept {
    const std::uint32_t before = std::exchange(acting_, 0);

    // Is there a force to trust? Every cause is looked at, so that each is counted.
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

    bool open = (acting_ & kZeroing) == 0;
    open &= isEngaged(engagement_);  // guard
    const bool small = length(in.wrench_o.force) <= kSmallShare * force_.peak &&
                       length(in.wrench_o.torque) <= kSmallShare * torque_.peak;
    open &= small || !waiting_;  // guard

    Wrench out;
    if (open) {
        waiting_ = false;
        out = in.wrench_o;
        limit(force_, out.force, 0, in);
        limit(torque_, out.torque, 1, in);
    }
    overloadMs_ = acting_ & (bit(Trip::ForceClamped) | bit(Trip::TorqueClamped)) ? overloadMs_ + in.dt : 0;
    trip(Trip::Overload, motors_ && overloadMs_ > kOverloadMs);  // guard

    zeroed_ = !open || (acting_ & kZeroing);
    if (zeroed_) out = {};  // guard
    if (acting_ & kFaults) {
        engagement_ = Engagement::Faulted;  // guard
        cause_ = static_cast<Trip>(std::countr_zero(acting_ & kFaults));
    } else if (engagement_ == Engagement::Engaged && zeroed_) {
        engagement_ = Engagement::Engaging;
    } else if (open && in.fade >= 1) {
        engagement_ = Engagement::Engaged;
    }
    force_.last = out.force;
    torque_.last = out.torque;
    for (Channel* channel : {&force_, &torque_}) {
        if (motors_) channel->warm(in.dt);
        if (zeroed_) channel->turns = 0;
    }

    for (int i = 0; i < kTripCount; ++i) {
        counts_[i].ticks += acting_ >> i & 1;
        counts_[i].events += (acting_ & ~before) >> i & 1;
    }
    return out;
}

}  // namespace touchstone
