#pragma once
// Poses over time, for demonstrations and recordings.
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "haptics/device/device.hpp"

namespace touchstone {

/// A motion of the tool node in the scene frame. Immutable; shared between threads.
class Motion {
  public:
    virtual ~Motion() = default;
    /// Pose at `t` ms since the start. Outside [0, duration()] it is the first or the last pose.
    /// Real time: no allocation, lock or throw.
    virtual Pose at(double t) const noexcept = 0;
    virtual double duration() const noexcept = 0;  ///< ms
};

/// One of a scene's motions.
struct NamedMotion {
    std::string name;
    std::shared_ptr<const Motion> motion;
};

struct MotionKey {
    double t = 0;  ///< ms
    Pose X_WT;
};

/// Keys with linear interpolation of the position and slerp of the orientation (along the shorter arc).
class RecordedMotion final : public Motion {
  public:
    /// Pre: at least one key, t strictly increasing, all finite.
    explicit RecordedMotion(std::vector<MotionKey> keys);
    Pose at(double t) const noexcept override;  ///< O(log keys)
    double duration() const noexcept override { return keys_.back().t; }
    std::span<const MotionKey> keys() const { return keys_; }

  private:
    std::vector<MotionKey> keys_;
};

/// Reads a CSV file: the header `t_ms,x_mm,y_mm,z_mm,qw,qx,qy,qz`, then one key per row. Quaternions within 1e-3 of
/// unit length are normalized. Throws std::runtime_error with one sentence that names file and line.
RecordedMotion readMotion(const std::filesystem::path& file);
/// Writes a file that readMotion() reads back bit for bit. Throws std::runtime_error if the file cannot be written.
void writeMotion(const std::filesystem::path& file, std::span<const MotionKey> keys);

/// A device that follows a motion and ignores the wrench, for demonstrations and replays.
class MotionDevice final : public Device {
  public:
    explicit MotionDevice(std::shared_ptr<const Motion> motion) : motion_(std::move(motion)) {}
    DeviceReading read(double t, double) noexcept override {
        return {.X_WT_device = motion_->at(t), .valid = true, .finished = t >= motion_->duration()};
    }
    void write(const Wrench&) noexcept override {}
    DeviceLimits limits() const noexcept override { return {.motors = false}; }
    std::optional<double> duration() const noexcept override { return motion_->duration(); }

  private:
    std::shared_ptr<const Motion> motion_;
};

}  // namespace touchstone
