#pragma once
// A simulated hand that puts the tool into a hole by feel: what stands for a person where trials are tests.
#include <array>
#include <cstdint>

#include "haptics/device/device.hpp"
#include "haptics/device/hand.hpp"

namespace touchstone {

/// How a hand looks for the hole. The seed draws what differs from hand to hand: errors and tremor by these standard
/// deviations, and how fast, hard and patient it is by some 15 % about what stands here.
struct InsertingParameters {
    HandParameters hand;
    std::uint64_t seed = 1;
    double startError = 2, startTwistError = 0.15;  ///< of the first pose, mm and rad
    double placeError = 0.45, axisError = 0.012;    ///< of where it thinks the goal is, mm, and how tilted, rad
    double tremor = 0.03, tremorAngle = 0.002;      ///< at 8 to 12 Hz, mm and rad
    double speed = 0.03;                            ///< of the way there and in, mm/ms
    double press = 2.5;                             ///< N
    double sweep = 0.55, sweepSpeed = 0.002;        ///< turns to and fro about the axis, rad and rad/ms
    double spiral = 1.2, pitch = 0.15, spiralSpeed = 1.2e-3;  ///< across the axis: radius, between turns, mm; mm/ms
    double patience = 25'000;  ///< ms of searching after which it gives up and draws back
    double hold = 0;           ///< ms that the tool is to stay at the goal: it looks on for at least that long
};

/// A mass on a spring to a target that it moves by what a person has: its own pose, the wrench it feels, and roughly
/// where the goal is. It goes above the goal, comes down along +y of the goal's frame until it feels something, and
/// presses on. While that gets it nowhere it turns to and fro and moves along a spiral; while it gets in, it yields in
/// all but the way in. When it is stuck near the goal it lets go. Real time: no allocation, lock or throw.
class InsertingHand final : public Device {
  public:
    /// `X_WT_start`: without error; `X_WG`: the goal, its +y the way out.
    InsertingHand(const Pose& X_WT_start, const Pose& X_WG, const InsertingParameters& parameters);
    DeviceReading read(double t, double dt) noexcept override;
    void write(const Wrench& wrench_o) noexcept override { felt_ = wrench_o; }
    void engage(const Pose& X_WT) noexcept override;
    DeviceLimits limits() const noexcept override { return {.motors = false}; }
    std::optional<DeviceDynamics> dynamics() const noexcept override { return {{parameters_.hand.damping, 0}}; }

    enum class Act : std::uint8_t { Approach, Press, LetGo, DrawBack };
    Act act() const { return act_; }
    /// Where it thinks the goal is.
    const Pose& belief() const { return X_WB_; }

  private:
    /// Where the hand is in the frame of its belief.
    struct Place {
        Vec3 p = Vec3::Zero();     // mm, y the way out
        Vec3 tilt = Vec3::Zero();  // of the axis, rad; y is 0
        double twist = 0;          // about it, before the tilt, rad; never jumps
    };
    Place placeOf(const Pose& X_WT) const;
    Pose poseOf(const Place& place) const;
    void begin();
    void change(Act act);
    void approach(double dt);
    void press(const Place& own, double dt);
    void search(const Place& own, double dt);
    void yield(const Place& own, double dt);
    Place trembling(double t) const;

    InsertingParameters parameters_;
    Pose X_WT_start_, X_WB_;
    std::array<double, 12> tremor_{};  // frequency and phase of each axis
    Hand hand_;
    Wrench felt_;
    Place target_, centre_;  // of the spring, and of the search
    Act act_ = Act::Approach;
    double actMs_ = 0;
    double push_ = 0;                   // felt along the way out, smoothed a little, N
    double lowest_ = 0, stuckMs_ = 0;   // on the way in, mm, and since then
    double searchMs_ = 0, spiral_ = 0;  // in all, and the angle along the spiral, rad
    double firstWay_ = 1, way_ = 1;     // of turning
};

/// Row of the device table: insert[:SEED]. Throws std::runtime_error with one sentence when the scene has no goal or
/// the seed is no whole number.
std::unique_ptr<Device> makeInsertingHand(const DeviceContext& context);

}  // namespace touchstone
