#include "haptics/device/inserting_hand.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

namespace touchstone {
namespace {

constexpr double kTau = 2 * std::numbers::pi;
constexpr double kContactForce = 0.4;  // N, felt force that counts as a contact
constexpr double kSmoothMs = 10;       // time constant with which the felt force is smoothed
constexpr double kProgress = 0.3;      // mm; the tool is stuck if it moves in by less than this within kStuckMs
constexpr double kStuckMs = 120;
constexpr double kComplyMs = 60;     // time constant with which the target follows the hand where it complies
constexpr double kGoalHeight = 3;    // mm above the goal; a tool that is stuck below this height has arrived
constexpr double kFarBelow = 15;     // mm below the goal, where the hand stops going down
constexpr double kArrivedMs = 300;   // time of being stuck at the goal until the hand stops pressing
constexpr double kReleaseMs = 300;   // time in which the pressing force falls to zero
constexpr double kObserveMs = 1200;  // least time after the release in which the hand observes whether the tool stays
constexpr double kSettleMs = 700;    // time that the tool may need to come to rest, before it must stay at the goal
constexpr double kDrawBackMs = 2000;
constexpr double kMaxTwistLead = 0.08;  // rad by which the target's twist leads the tool's before the sweep reverses

/// Random numbers that are the same on every platform, unlike the distributions of the standard library.
class Draw {
  public:
    explicit Draw(std::uint64_t seed) : random_(seed) {}
    double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
    double normal() {
        const double radius = std::sqrt(-2 * std::log(1 - uniform()));
        return radius * std::cos(kTau * uniform());
    }
    Vec3 vector(double deviation) {
        const double x = normal(), y = normal(), z = normal();
        return deviation * Vec3(x, y, z);
    }

  private:
    std::mt19937_64 random_;
};

}  // namespace

InsertingHand::InsertingHand(const Pose& X_WT_start, const Pose& X_WG, const InsertingParameters& parameters)
    : parameters_(parameters), hand_(parameters.hand, X_WT_start) {
    Draw draw(parameters.seed);
    const Vec3 aside = draw.vector(parameters.startError);
    const double twisted = parameters.startTwistError * draw.normal();
    const Vec3 place = draw.vector(parameters.placeError), axis = draw.vector(parameters.axisError);
    X_WB_ = X_WG * Pose{place, expRotation({axis.x(), 0, axis.z()})};
    Place start = placeOf(X_WT_start);
    // The error never moves the start down, toward the part.
    start.p += Vec3(aside.x(), std::abs(aside.y()), aside.z());
    start.twist += twisted;
    X_WT_start_ = poseOf(start);
    for (std::size_t i = 0; i < tremor_.size(); i += 2) {
        tremor_[i] = kTau * (0.008 + 0.004 * draw.uniform());
        tremor_[i + 1] = kTau * draw.uniform();
    }
    for (double* one : {&parameters_.speed, &parameters_.press, &parameters_.sweepSpeed, &parameters_.spiralSpeed,
                        &parameters_.patience})
        *one *= std::exp(0.15 * draw.normal());
    firstSweepSign_ = draw.uniform() < 0.5 ? -1 : 1;
    begin();
}

InsertingHand::Place InsertingHand::placeOf(const Pose& X_WT) const {
    const Pose X_BT = X_WB_.inverse() * X_WT;
    const Quat twist = Quat(X_BT.q.w(), 0, X_BT.q.y(), 0).normalized();
    Place place{X_BT.p, logRotation(X_BT.q * twist.conjugate()), 2 * std::atan2(twist.y(), twist.w())};
    place.twist += kTau * std::round((target_.twist - place.twist) / kTau);
    return place;
}

Pose InsertingHand::poseOf(const Place& place) const {
    return X_WB_ * Pose{place.p, expRotation(place.tilt) * expRotation({0, place.twist, 0})};
}

void InsertingHand::begin() {
    hand_.reset(X_WT_start_);
    felt_ = {};
    target_ = searchCenter_ = {};
    target_ = placeOf(X_WT_start_);
    push_ = searchMs_ = 0;
    sweepSign_ = firstSweepSign_;
    change(Act::Approach);
}

void InsertingHand::change(Act act) {
    act_ = act;
    actMs_ = stuckMs_ = 0;
    lowest_ = target_.p.y();
}

DeviceReading InsertingHand::read(double t, double dt) noexcept {
    if (t <= 0) {
        begin();
        return {.X_WT_device = X_WT_start_};
    }
    const Place current = placeOf(hand_.pose());
    const double push = X_WB_.q.conjugate()._transformVector(felt_.force).y();
    push_ += (push - push_) * std::min(1.0, dt / kSmoothMs);
    actMs_ += dt;
    bool finished = false;
    switch (act_) {
        case Act::Approach:
            approach(dt);
            break;
        case Act::Press:
            press(current, dt);
            break;
        case Act::LetGo:
            comply(current, dt);
            target_.p.y() =
                current.p.y() - std::max(0.0, 1 - actMs_ / kReleaseMs) * parameters_.press / parameters_.hand.spring;
            finished = actMs_ > kReleaseMs + std::max(kObserveMs, kSettleMs + parameters_.hold);
            break;
        case Act::DrawBack:
            target_.p.y() += parameters_.speed * dt;
            finished = actMs_ > kDrawBackMs;
            break;
    }
    return {.X_WT_device = hand_.advance(poseOf(withTremor(t)), felt_, dt), .finished = finished};
}

void InsertingHand::approach(double dt) {
    const double step = parameters_.speed * dt, aside = std::hypot(target_.p.x(), target_.p.z());
    target_.tilt *= std::exp(-dt / kComplyMs);
    if (aside > step) {
        target_.p -= step / aside * Vec3(target_.p.x(), 0, target_.p.z());
    } else {
        target_.p.y() -= step;
        if (push_ > kContactForce) change(Act::Press);
        if (target_.p.y() < -kFarBelow) change(Act::DrawBack);  // there is no part to touch
    }
}

void InsertingHand::comply(const Place& current, double dt) {
    const double keep = std::exp(-dt / kComplyMs), y = target_.p.y();
    target_.p = current.p + keep * (target_.p - current.p);
    target_.p.y() = y;
    target_.tilt = current.tilt + keep * (target_.tilt - current.tilt);
    target_.twist = current.twist + keep * (target_.twist - current.twist);
}

void InsertingHand::press(const Place& current, double dt) {
    target_.p.y() =
        std::max(target_.p.y() - parameters_.speed * dt, current.p.y() - parameters_.press / parameters_.hand.spring);
    stuckMs_ += dt;
    if (current.p.y() < lowest_ - kProgress) {
        lowest_ = current.p.y();
        stuckMs_ = 0;
    }
    const bool arrived = current.p.y() < kGoalHeight;
    if (stuckMs_ > kStuckMs && !arrived)
        search(current, dt);
    else
        comply(current, dt);
    if (arrived && stuckMs_ > kArrivedMs) change(Act::LetGo);
    const bool throughHole = current.p.y() < -kFarBelow;
    if (searchMs_ > parameters_.patience || throughHole) change(Act::DrawBack);
}

void InsertingHand::search(const Place& current, double dt) {
    const InsertingParameters& h = parameters_;
    if (stuckMs_ <= kStuckMs + dt) {
        searchCenter_ = current;
        spiralAngle_ = 0;
    }
    searchMs_ += dt;
    const double radius = h.pitch * spiralAngle_ / kTau;
    spiralAngle_ = radius > h.spiral ? 0 : spiralAngle_ + h.spiralSpeed * dt / std::max(radius, h.pitch);
    target_.p.x() = searchCenter_.p.x() + radius * std::cos(spiralAngle_);
    target_.p.z() = searchCenter_.p.z() + radius * std::sin(spiralAngle_);
    target_.tilt = current.tilt + std::exp(-dt / kComplyMs) * (target_.tilt - current.tilt);
    if (sweepSign_ * (target_.twist - searchCenter_.twist) > h.sweep ||
        sweepSign_ * (target_.twist - current.twist) > kMaxTwistLead)
        sweepSign_ = -sweepSign_;
    target_.twist += sweepSign_ * h.sweepSpeed * dt;
}

InsertingHand::Place InsertingHand::withTremor(double t) const {
    if (act_ == Act::LetGo) return target_;
    std::array<double, 6> shake;
    for (std::size_t i = 0; i < shake.size(); ++i) shake[i] = std::sin(tremor_[2 * i] * t + tremor_[2 * i + 1]);
    Place place = target_;
    place.p += parameters_.tremor * Vec3(shake[0], shake[1], shake[2]);
    place.tilt += parameters_.tremorAngle * Vec3(shake[3], 0, shake[4]);
    place.twist += parameters_.tremorAngle * shake[5];
    return place;
}

void InsertingHand::engage(const Pose& X_WT) noexcept {
    hand_.reset(X_WT);
    target_ = placeOf(X_WT);
    change(Act::Approach);
}

std::unique_ptr<Device> makeInsertingHand(const DeviceContext& context) {
    if (!context.goal)
        throw std::runtime_error("this scene has no goal: give a node the role goal, or choose another --device");
    InsertingParameters parameters;
    parameters.hold = context.goalHold;
    const char *first = context.file.data(), *last = first + context.file.size();
    if (!context.file.empty()) {
        const auto [end, error] = std::from_chars(first, last, parameters.seed);
        if (error != std::errc() || end != last)
            throw std::runtime_error("'" + context.file +
                                     "' is not a seed: write --device insert:SEED with a whole number");
    }
    return std::make_unique<InsertingHand>(context.X_WT_start, *context.goal, parameters);
}

}  // namespace touchstone
