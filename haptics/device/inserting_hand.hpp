#pragma once
// A simulated hand that inserts the tool into a hole by feel. It replaces a person when trials run as tests.
#include <array>
#include <cstdint>

#include "haptics/device/device.hpp"
#include "haptics/device/hand.hpp"

namespace touchstone {

/// Parameters of the search for the hole. The random seed determines what differs between hands: errors with the
/// standard deviations below, the phase and frequency of the tremor, and speed, force and patience, which vary by about
/// 15 % around the values below.
struct InsertingParameters {
    HandParameters hand;
    std::uint64_t seed = 1;
    double startError = 2, startTwistError = 0.15;  ///< error of the first pose, mm and rad
    double placeError = 0.45, axisError = 0.012;    ///< error of the assumed position, mm, and axis, rad, of the goal
    double tremor = 0.03, tremorAngle = 0.002;      ///< amplitudes of the tremor at 8 to 12 Hz, mm and rad
    double speed = 0.03;                            ///< speed of approach and insertion, mm/ms
    double press = 2.5;                             ///< pressing force, N
    double sweep = 0.55, sweepSpeed = 0.002;        ///< amplitude and speed of the twisting search, rad and rad/ms
    double spiral = 1.2, pitch = 0.15;              ///< spiral search: maximum radius and distance of the turns, mm
    double spiralSpeed = 1.2e-3;                    ///< speed along the spiral, mm/ms
    double patience = 25'000;                       ///< ms of searching after which the hand gives up and draws back
    double hold = 0;  ///< ms that the tool must stay at the goal; it is observed at least as long
};

/// A simulated hand whose spring pulls to a target. The target moves according to what a person knows: the hand's pose,
/// the felt wrench and the approximate place of the goal. The hand moves above the goal, moves down along the y axis of
/// the goal's frame until it feels a contact, and keeps pressing. While the tool is stuck, the target twists back and
/// forth and follows a spiral; while the tool moves in, the hand complies in all other directions. When the tool is
/// stuck near the goal, the hand stops pressing. Real time: no allocation, lock or throw.
class InsertingHand final : public Device {
  public:
    /// `X_WT_start` is the start pose without error. `X_WG` is the goal, whose +y axis points out of the hole.
    InsertingHand(const Pose& X_WT_start, const Pose& X_WG, const InsertingParameters& parameters);
    DeviceReading read(double t, double dt) noexcept override;
    void write(const Wrench& wrench_o) noexcept override { felt_ = wrench_o; }
    void engage(const Pose& X_WT) noexcept override;
    DeviceLimits limits() const noexcept override { return {.motors = false}; }
    std::optional<DeviceDynamics> dynamics() const noexcept override { return {{parameters_.hand.damping, 0}}; }

    enum class Act : std::uint8_t { Approach, Press, LetGo, DrawBack };
    Act act() const { return act_; }
    /// The pose that the hand assumes for the goal.
    const Pose& belief() const { return X_WB_; }

  private:
    /// A tool pose in the frame of the assumed goal.
    struct Place {
        Vec3 p = Vec3::Zero();     // mm; y points out of the hole
        Vec3 tilt = Vec3::Zero();  // tilt of the axis, rad; y is 0
        double twist = 0;          // rotation about the axis, before the tilt, rad; unwrapped, so that it never jumps
    };
    Place placeOf(const Pose& X_WT) const;
    Pose poseOf(const Place& place) const;
    void begin();
    void change(Act act);
    void approach(double dt);
    void press(const Place& current, double dt);
    void search(const Place& current, double dt);
    void comply(const Place& current, double dt);
    Place withTremor(double t) const;

    InsertingParameters parameters_;
    Pose X_WT_start_, X_WB_;
    std::array<double, 12> tremor_{};  // frequency, rad/ms, and phase, rad, of each axis
    Hand hand_;
    Wrench felt_;
    Place target_, searchCenter_;  // target of the spring; center of the search
    Act act_ = Act::Approach;
    double actMs_ = 0;
    double push_ = 0;                            // felt force along the way out, smoothed, N
    double lowest_ = 0, stuckMs_ = 0;            // lowest y with progress, mm, and the time since then
    double searchMs_ = 0, spiralAngle_ = 0;      // total time of searching, and the angle along the spiral, rad
    double firstSweepSign_ = 1, sweepSign_ = 1;  // direction of the twisting search, 1 or -1
};

/// Row of the device table: insert[:SEED]. Throws std::runtime_error with one sentence if the scene has no goal or the
/// seed is not a whole number.
std::unique_ptr<Device> makeInsertingHand(const DeviceContext& context);

}  // namespace touchstone
