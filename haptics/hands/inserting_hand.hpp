#pragma once
// A simulated hand that assembles by feel. It replaces a person when trials run as tests.
#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "haptics/device/device.hpp"
#include "haptics/device/device_table.hpp"
#include "haptics/hands/hand.hpp"

namespace touchstone {

/// Parameters of the assembly. The random seed determines what differs between hands: errors with the standard
/// deviations below, the phase and frequency of the tremor, and speed, force and patience, which vary by about 15 %
/// around the values below.
struct InsertingParameters {
    HandParameters hand;
    std::uint64_t seed = 1;
    double startError = 2, startTwistError = 0.15;  ///< error of the first pose, mm and rad
    double placeError = 0.45, axisError = 0.012;    ///< error of the assumed position, mm, and axis, rad, of the goal
    double twistError = 0.05;                       ///< error of the assumed orientation about the axis, rad
    double look = 0.2;  ///< error with which the tool is seen to be at its goal, as a share of the goal's tolerances
    double tremor = 0.03, tremorAngle = 0.002;  ///< amplitudes of the tremor at 8 to 12 Hz, mm and rad
    double speed = 0.03;                        ///< speed of approach and insertion, mm/ms
    double turnSpeed = 0.004;                   ///< speed of turning a thread, rad/ms
    double press = 2.5;                         ///< pressing force, N
    double sweep = 0.55, sweepSpeed = 0.002;    ///< amplitude and speed of the twisting search, rad and rad/ms
    double spiral = 1.2, pitch = 0.15;          ///< spiral search: maximum radius and distance of the turns, mm
    double spiralSpeed = 2.5e-3;                ///< speed along the spiral, mm/ms
    double tilt = 0.12, tiltShift = 0.5;        ///< tilted search: tilt, rad, and shift of the tool, mm
    double patience = 25'000;                   ///< ms of searching after which the hand gives up and draws back
};

/// A simulated hand whose spring pulls to a target. The target moves according to what a person knows: the hand's pose,
/// the tool's pose as it is seen, the felt wrench, the approximate pose of the goal and the way there. The hand moves
/// to the start of the way and along its segments: it presses on along the segment and complies in all other
/// directions. While the tool is stuck, the target searches: it twists back and forth along a spiral, or tilts the tool
/// and rights it. On a thread it turns. At the goal it brings the tool to where it sees the goal, and lets go. An
/// attempt that fails is repeated from the start of the way. Real time: no allocation, lock or throw.
class InsertingHand final : public Device {
  public:
    /// `X_WT_start` is the start pose without error.
    InsertingHand(const Pose& X_WT_start, const GoalRegion& goal, const InsertingParameters& parameters);
    DeviceReading read(double t, double dt) noexcept override;
    void write(const Wrench& wrench_o) noexcept override { felt_ = wrench_o; }
    void show(const Pose& X_WT) noexcept override { X_WT_seen_ = X_WT; }
    void engage(const Pose& X_WT) noexcept override;
    DeviceLimits limits() const noexcept override { return {.motors = false}; }
    std::optional<DeviceDynamics> dynamics() const noexcept override { return {{parameters_.hand.damping, 0}}; }

    enum class Act : std::uint8_t { Approach, Press, Settle, Release, Retreat, DrawBack };
    Act act() const { return act_; }
    /// The pose that the hand assumes for the goal.
    const Pose& belief() const { return X_WB_; }

  private:
    /// A tool pose relative to the end of a segment: position along the segment's axes, mm, whose y points out, and
    /// rotation, as a tilt about x and z after a twist about y, times kLever, mm. The twist does not jump.
    using Place = Vec6;
    /// A straight piece of the way, in the frame of the goal.
    struct Segment {
        Pose X_GS;  ///< origin at the end of the segment, y pointing out
        Quat q_ST;  ///< orientation of the tool at the end
        Place in;   ///< unit direction of progress
        double length = 0;
        bool turns = false;  ///< progress is mostly rotation
        double past = 0;     ///< mm that a tool that is not stopped goes past the end, before a sharp bend
    };
    static std::vector<Segment> segmentsOf(const GoalRegion& goal, const Pose& X_GT_start);
    static Place placeOf(const Segment& segment, const Pose& X_GT, const Place& near);
    static Pose poseOf(const Segment& segment, const Place& place);

    const Segment& segment() const { return segments_[segment_]; }
    bool last() const { return segment_ + 1 == segments_.size(); }
    void begin() noexcept;
    void look() noexcept;
    void change(Act act) noexcept;
    void enter(std::size_t segment) noexcept;
    double begins() const noexcept;
    void approach(double dt) noexcept;
    void press(double dt) noexcept;
    void search(double dt) noexcept;
    double twistLeft() const noexcept;
    void screw(bool stuck, double rest, double dt) noexcept;
    void turn(bool in, double dt) noexcept;
    void settle(double dt) noexcept;
    void retreat(double dt) noexcept;
    void comply(double dt) noexcept;
    Place fromGoal() const noexcept;
    bool isSeenAtGoal(double share) const noexcept;
    Place withTremor(double t) const noexcept;

    InsertingParameters parameters_;
    GoalRegion goal_;
    Pose X_WT_start_, X_WB_, X_WV_;  // the goal as assumed, and as seen beside the tool
    std::vector<Segment> segments_;
    std::mt19937_64 random_;
    std::array<double, 12> tremor_{};  // frequency, rad/ms, and phase, rad, of each axis
    Hand hand_;
    Wrench felt_;
    Pose X_WT_seen_;
    std::size_t segment_ = 0;
    Place target_ = Place::Zero(), held_ = Place::Zero();        // of the spring, and of the hand
    Place seen_ = Place::Zero(), searchCenter_ = Place::Zero();  // of the tool, and where the search began
    Act act_ = Act::Approach;
    double actMs_ = 0;
    double least_ = 0, stuckMs_ = 0;  // least distance to the end of the segment, mm, and the time since then
    double searchMs_ = 0, attemptMs_ = 0, spiralAngle_ = 0;  // time of searching, all and of this attempt
    bool eased_ = false;                                     // presses less, since friction holds the tool
    Place rested_ = Place::Zero();                           // where the tool was when it last moved
    double stillMs_ = 0;                                     // time since then
    int attempts_ = 0;                                       // that failed
    double first_ = 0;                                       // distance from the goal at the first contact, mm
    enum class Thread : std::uint8_t { None, In, Back } thread_ = Thread::None;
    double height_ = 0, from_ = 0;  // on a thread: a distance and a twist that progress is measured from, mm
    double firstSweepSign_ = 1, sweepSign_ = 1;  // direction of the twisting search, 1 or -1
};

/// Row of the device table: insert[:SEED]. Throws std::runtime_error with one sentence if the scene has no goal or the
/// seed is not a whole number.
std::unique_ptr<Device> makeInsertingHand(const DeviceContext& context);

}  // namespace touchstone
