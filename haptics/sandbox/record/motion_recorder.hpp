#pragma once
// Records what the device does as a motion: a demonstration by hand.
#include <cstdint>
#include <vector>

#include "haptics/hands/motion.hpp"
#include "haptics/loop/step.hpp"

namespace touchstone::sandbox {

/// Largest deviation of a recorded motion from the poses of the device, with linear interpolation between its keys.
inline constexpr double kMotionErrorMm = 0.005, kMotionErrorRad = 1e-4;

/// Keeps the samples of a motion that linear interpolation needs to stay within the errors above.
class MotionThinner {
  public:
    /// Pre: `t` (ms) is later than that of the sample before.
    void add(double t, const Pose& X_WT);
    /// All keys up to the last sample.
    std::vector<MotionKey> keys() const;

  private:
    bool follows(const MotionKey& end) const;

    std::vector<MotionKey> keys_;
    std::vector<MotionKey> since_;  ///< samples after the last key
};

/// Records the device pose of every tick, with the time in which the tool is free to move: a paused or stopped session,
/// or a device without a pose, takes no time. Where the pose jumps because the session was paused, the device changed
/// or nothing was recorded before, the motion goes there in a straight line at kJoinMmPerMs and kJoinRadPerMs. It
/// begins at the tool pose, which is out of all obstacles even while the device presses into one, and rest before the
/// first movement is shortened to kLeadMs.
class MotionRecorder {
  public:
    static constexpr double kJoinMmPerMs = 0.05, kJoinRadPerMs = 0.001, kLeadMs = 200;

    /// `waits`: begins only when the tool starts again.
    explicit MotionRecorder(bool waits = false) : waits_(waits) {}

    /// Takes the next tick.
    void add(const RecordedTick& tick);
    double duration() const { return t_; }  ///< ms
    /// Whether the device has moved.
    bool moved() const { return moved_; }
    std::vector<MotionKey> keys() const { return thinner_.keys(); }

  private:
    void append(double dt, const Pose& X_WT);
    void join(const Pose& X_WT);

    MotionThinner thinner_;
    double t_ = 0;
    bool waits_, begun_ = false, moved_ = false, joins_ = false;
    std::uint64_t session_ = 0;
    Pose first_, last_;
};

}  // namespace touchstone::sandbox
